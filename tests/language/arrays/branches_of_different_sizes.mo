// A parameter decides which of two tables there is (3.6.5).
model Run
  parameter Integer n = 2;
  parameter Real a[:] = {1, 2, 3};
  parameter Real t[:, 2] = if n > 0 then [a, 2*a] else [0, 0];
  Real y = t[3, 2];
  Real s = sum(if n > 3 then {time} else {time, 2*time});
  // expect: y @ 1 = 6
  // expect: s @ 1 = 3
end Run;
