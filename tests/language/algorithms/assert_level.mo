// A warning does not end the run.
model Run
  Real y;
algorithm
  y := 2*time;
  assert(level = AssertionLevel.warning, condition = y < 1.996, message = "y is large");
  // expect: y @ 1 = 2
end Run;
