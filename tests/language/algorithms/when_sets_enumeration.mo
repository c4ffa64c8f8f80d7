// A variable of an enumeration keeps its value where a `when` does not fire.
model Run
  type L = enumeration(off, on);
  L y(start = L.off, fixed = true);
  Real x = if y == L.on then 1 else 0;
algorithm
  when time > 0.3 then
    y := L.on;
  end when;
  // expect: x @ 0.2 = 0
  // expect: x @ 0.4 = 1
end Run;
