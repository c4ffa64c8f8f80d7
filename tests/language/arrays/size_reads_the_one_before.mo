// Sizes of a declaration may read those before them (Modelica 3.6, section 10.1: `:` takes its size from the value).
block System
  parameter Real A[:, size(A, 1)] = [-1, 0; 0, -2];
  parameter Real B[size(A, 1), :] = [1; 1];
  Real x[size(A, 1)](each start = 1, each fixed = true);
  Real u[size(B, 2)] = fill(0, size(B, 2));
equation
  der(x) = A*x + B*u;
end System;
model Run
  System system;
  System larger(A = [-1, 0, 0; 0, -2, 0; 0, 0, -3], B = [1, 0; 0, 1; 1, 1]);
  Real y = larger.x[3];
  Real n = size(larger.B, 2);
  // expect: y @ 1 = 0.049787068367863944
  // expect: n @ 1 = 2
end Run;
