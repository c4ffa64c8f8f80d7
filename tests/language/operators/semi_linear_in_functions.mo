// (Modelica 3.6, section 3.7.4.5)
function f
  input Real x;
  output Real y = semiLinear(x, 2, 3);
end f;
function g
  input Real x;
  input Real k[2];
  output Real y[2];
algorithm
  y := semiLinear({x, -x}, k, {5, 6});
end g;
model Run
  Real y = f(time - 0.5);
  Real z[2] = g(time - 0.5, {1, 2});
  // expect: y @ 1 = 1
  // expect: y @ 0 = -1.5
  // expect: z[1] @ 1 = 0.5
  // expect: z[2] @ 1 = -3
end Run;
