record V
  Real a;
  Real b;
end V;
record W = V(a = 1, b = 2);
record N
  V v;
  W w;
end N;
function mk
  input Real t;
  output V v[2] = {W(a = t), V(t, t)};
end mk;
model Run
  V x[2];
  N n = N(W(), W(b = time));
  N m(v = W(a = 3), w(a = 7));
  V lst[2] = mk(time);
  Real y = pick({N(W(), W(3)), N(W(5), W())}, 2);
  function pick
    input N n[:];
    input Integer k;
    output Real y = n[k].v.a + 10*n[k].w.b + 100*n[1].w.a;
  end pick;
equation
  x = {W(), W(a = time)};
  // expect: x[1].b @ 1 = 2
  // expect: x[2].a @ 1 = 1
  // expect: n.v.a @ 1 = 1
  // expect: n.w.b @ 1 = 1
  // expect: n.w.a @ 1 = 1
  // expect: m.v.a @ 1 = 3
  // expect: m.v.b @ 1 = 2
  // expect: m.w.a @ 1 = 7
  // expect: m.w.b @ 1 = 2
  // expect: lst[1].a @ 1 = 1
  // expect: lst[1].b @ 1 = 2
  // expect: y @ 1 = 5 + 20 + 300
end Run;
