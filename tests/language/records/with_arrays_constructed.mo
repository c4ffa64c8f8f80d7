record V
  Real x[2] = {1, 2};
  Real y;
end V;
record W = V(y = 3);
record U
  extends V(y = x[1] + x[2]);
  parameter Integer n = 2;
  Real z[n] = x*2;
end U;
function f
  input U u;
  output Real s = sum(u.x) + 10*u.y + 100*sum(u.z);
end f;
function given_x
  input Real t;
  output U u(x = {t, t});
algorithm
  u.y := u.y;
end given_x;
model A
  replaceable V v(x = {5, 6});
  Real q = sum(v.x);
end A;
model Run
  Real a = f(U());
  Real b = f(U(x = {time, 4}));
  Real c = f(given_x(time));
  W w = W(x = {7, 8});
  V v2 = W();
  A m(redeclare U v(x = {1, 1}));
  A n(v = W());
  A o[2](v = {W(), V({1, 2}, 9)});
  // expect: a @ 1 = 3 + 30 + 600
  // expect: b @ 1 = 5 + 50 + 1000
  // expect: c @ 1 = 2 + 20 + 400
  // expect: w.x[2] @ 1 = 8
  // expect: w.y @ 1 = 3
  // expect: v2.x[1] @ 1 = 1
  // expect: m.v.y @ 1 = 2
  // expect: m.q @ 1 = 2
  // expect: n.q @ 1 = 3
  // expect: o[2].v.y @ 1 = 9
  // expect: o[1].v.y @ 1 = 3
end Run;
