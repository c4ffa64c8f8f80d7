// Arrays of records by constructors, comprehensions and `fill`, as bindings, in equations and in `if` expressions.
record R
  Real a = 1;
  Real b = 2*a;
end R;
record V
  Real a;
  Real b;
end V;
record W
  extends V(a = 1, b = 2*a);
end W;
record S
  extends R(a = 4);
  Real c[2] = {a, b};
end S;
function made
  input Real x;
  output R r;
algorithm
  r := R(x, 100*x);
end made;
model Part
  R r = R(b = 5);
  R v[2];
end Part;
model Run
  parameter R p[2] = {R(), R(a = 9)};
  R q[2] = {R(a = time), R(b = 3)};
  R c[3] = {R(i) for i in 1:3};
  R f[2] = fill(R(a = 8), 2);
  R g[2, 2] = fill(R(b = time), 2, 2);
  R m[3] = {R(1), made(time), S()};
  S s[2] = {S(), S(a = 2)};
  R n[2, 2] = {{R(1), R(2)}, {R(3), R()}};
  V e;
  V h;
  V w;
  V arr[2];
  V back;
  Real pa[2] = p.a;
  Real pb[2] = p.b;
  R slice[2] = c[2:3];
  R again[3] = {c[i] for i in {3, 2, 1}};
  R choice = if time > 2 then R(a = 3) elseif time > 0.5 then R(b = 6) else made(1);
  R lists[2] = if time > 2 then fill(R(), 2) else {R(5), R(b = 7)};
  Part part(r = R(a = 30), v = {R(3), R(4)});
  Part parts[2](r = {R(1), R(2)}, each v = {R(5), R(6)});
equation
  e = W(a = time);
  h = if time > 0.5 then W(b = time) else W(a = 2*time);
  if time > 0.5 then
    w = W(a = 7);
  else
    w = made(2);
  end if;
  W(a = 3*time) = back;
  for i in 1:2 loop
    arr[i] = W(i*time);
  end for;
  // expect: pa[1] @ 1 = 1
  // expect: pb[1] @ 1 = 2
  // expect: pa[2] @ 1 = 9
  // expect: pb[2] @ 1 = 18
  // expect: q[1].a @ 1 = 1
  // expect: q[1].b @ 1 = 2
  // expect: q[2].a @ 1 = 1
  // expect: q[2].b @ 1 = 3
  // expect: c[3].a @ 1 = 3
  // expect: c[3].b @ 1 = 6
  // expect: f[2].a @ 1 = 8
  // expect: f[2].b @ 1 = 16
  // expect: g[2,1].a @ 1 = 1
  // expect: g[2,1].b @ 0.5 = 0.5
  // expect: m[1].b @ 1 = 2
  // expect: m[2].b @ 1 = 100
  // expect: m[3].a @ 1 = 4
  // expect: m[3].b @ 1 = 8
  // expect: s[1].c[2] @ 1 = 8
  // expect: s[2].c[1] @ 1 = 2
  // expect: n[2,1].b @ 1 = 6
  // expect: n[2,2].b @ 1 = 2
  // expect: e.b @ 0.5 = 1
  // expect: h.a @ 1 = 1
  // expect: h.b @ 1 = 1
  // expect: h.b @ 0.25 = 1
  // expect: w.b @ 1 = 14
  // expect: w.b @ 0.25 = 200
  // expect: arr[2].a @ 1 = 2
  // expect: arr[2].b @ 1 = 4
  // expect: slice[2].b @ 1 = 6
  // expect: again[1].b @ 1 = 6
  // expect: choice.a @ 1 = 1
  // expect: choice.b @ 1 = 6
  // expect: choice.b @ 0.25 = 100
  // expect: lists[1].b @ 1 = 10
  // expect: lists[2].a @ 1 = 1
  // expect: part.r.a @ 1 = 30
  // expect: part.r.b @ 1 = 60
  // expect: part.v[2].b @ 1 = 8
  // expect: parts[2].r.b @ 1 = 4
  // expect: parts[1].v[2].b @ 1 = 12
  // expect: back.b @ 1 = 6
end Run;
