// A Real that a `when` further down sets changes at events only, so that its `pre` may be asked for in equations before it.
model Run
  Real peak;
  Real x(start = 0, fixed = true);
  Boolean above(start = false, fixed = true);
equation
  der(x) = 1;
  above = x > pre(peak) + 0.25;
  when {initial(), above} then
    peak = x;
  end when;
  // expect: peak @ 0.2 = 0
  // expect: peak @ 0.4 = 0.25
  // expect: peak @ 0.9 = 0.75
end Run;
