// What is evaluated at translation is set before it.
model Run
  parameter Real R = 0 annotation(Evaluate = true);
  Real x(start = 1, fixed = true);
  Real y(start = 0, fixed = true);
  Real i;
equation
  R*i = x - y;
  der(x) = -i;
  der(y) = i;
  // set: R = 2
  // expect: x @ 1 = 0.5 + 0.5*exp(-1)
  // expect: R @ 1 = 2
end Run;
