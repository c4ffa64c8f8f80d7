// An elementary function of an array in a value that decides sizes (12.4.6).
model Run
  parameter Real t[:, 2] = [linspace(0, 1, 5), sin(linspace(0, 1, 5))];
  parameter Integer n = integer(10*sum(floor({1.5, 2.5})));
  Real y = t[size(t, 1), 2];
  Real x[n];
equation
  x = fill(time, n);
  // expect: y @ 1 = sin(1)
  // expect: x[30] @ 1 = 1
end Run;
