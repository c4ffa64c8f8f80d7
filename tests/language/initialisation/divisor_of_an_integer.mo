// An Integer that follows from the time has its value before the equation that divides by it is evaluated.
model Run
  Integer n = if time >= 0 then 2 else 3;
  Integer m = n + k;
  parameter Integer k = 2;
  Real x(start = 1, fixed = true), y(start = 1, fixed = true);
equation
  der(x) = -x/n;
  der(y) = -y/m;
  // expect: n @ 0 = 2
  // expect: x @ 1 = exp(-0.5)
  // expect: y @ 1 = exp(-0.25)
end Run;
