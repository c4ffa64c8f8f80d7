// A start value that reads a parameter found at the start (`fixed = false`) is the value that the start finds (Modelica 3.6, 8.6).
model C
  parameter Real k(start = 1);
  Real z(start = k, fixed = true);
equation
  der(z) = if k > 1.5 then -1 else 1;
end C;
model M
  parameter Real k(fixed = false, start = 0.5);
  parameter Real m = 2*k;
  parameter Real v[2](each fixed = false, start = {1, 1});
  Real y[2](start = {k, 2*k}, each fixed = true);
  Real ym(start = m, fixed = true);
  Real yv[2](start = v, each fixed = true);
  discrete Real d(start = k, fixed = true);
  discrete Integer n(start = if k > 1.5 then 7 else 3, fixed = true);
  C c(k(fixed = false));
  Real x(start = 0, fixed = true);
initial equation
  k^2 = 4;
  v = {3, 4};
  c.k = 2*k;
equation
  for i in 1:2 loop
    der(y[i]) = 0;
  end for;
  der(ym) = 0;
  der(yv) = {0, 0};
  der(x) = d;
  when time > 0.5 then
    d = pre(d) + k;
    n = pre(n) + 1;
  end when;
  // expect: y[1] @ 0 = 2
  // expect: y[2] @ 0 = 4
  // expect: ym @ 0 = 4
  // expect: yv[1] @ 0 = 3
  // expect: yv[2] @ 0 = 4
  // expect: d @ 0 = 2
  // expect: n @ 0 = 7
  // expect: c.z @ 0 = 4
  // expect: c.z @ 1 = 3
  // expect: x @ 0.5 = 1
  // expect: d @ 1 = 4
  // expect: n @ 1 = 8
  // expect: x @ 1 = 3
end M;
