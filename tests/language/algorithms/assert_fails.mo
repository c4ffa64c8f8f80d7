// The value shown is the one at the place of the assertion.
model Run
  Real y;
algorithm
  y := 2*time;
  if time > 0.3 then
    assert(y < 1, "y is too large: " + String(y, significantDigits = 2));
  end if;
  y := 0;
  // run error: y is too large: 1
end Run;
