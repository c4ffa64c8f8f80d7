// Assertions hold at their place in the text, under the conditions around them; `terminate` ends the run.
model Run
  Real y;
  Real x = time;
  Integer n(start = 0, fixed = true);
algorithm
  y := 2*x;
  assert(y < 5, "y is too large");
  y := 10;
  if x > 2 then
    assert(y < 5, "never asked");
  end if;
  when time > 0.5 then
    n := 1;
    assert(n == 1, "n was set before");
  end when;
  when time > 0.75 then
    terminate("done");
  end when;
  // expect: y @ 0.6 = 10
  // expect: n @ 0.6 = 1
  // stopped at: 0.75
end Run;
