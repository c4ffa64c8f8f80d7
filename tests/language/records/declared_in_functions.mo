// Records of functions begin with the values of their declarations (Modelica 3.6, sections 12.4.4 and 12.6), run symbolically,
// compiled, and before the run.
record R
  Real a = 1;
  Real b = 2;
end R;
record D = R(a = 5);
record Nest
  R r(b = n + 1);
  Real n = 3;
  R list[2](each a = 7);
end Nest;
function local
  input Real x;
  output Real y;
protected
  R r(a = x);
  R s(b = r.a + 1);
  D d;
  Nest nest;
  R list[2](a = {x, 2*x});
algorithm
  y := r.a + 10*r.b + 100*s.a + 1000*s.b + 1e4*d.a + 1e5*nest.r.b + 1e6*nest.list[2].a + 1e7*list[2].a + 1e8*list[1].b;
end local;
function compiled
  input Real x;
  output Real y;
protected
  R r(a = x);
  R s(b = r.a + 1);
  D d;
  Nest nest;
  R list[2](a = {x, 2*x});
  Integer i = 1;
algorithm
  while i < x + 2 loop
    i := i + 1;
  end while;
  y := r.a + 10*r.b + 100*s.a + 1000*s.b + 1e4*d.a + 1e5*nest.r.b + 1e6*nest.list[2].a + 1e7*list[2].a + 1e8*list[1].b;
end compiled;
function partly
  input Real x;
  output R r;
algorithm
  r.b := x;
end partly;
function partly_compiled
  input Real x;
  output R r;
protected
  Real w = x;
algorithm
  while w < 10 loop
    w := w + 3;
  end while;
  r.b := w;
end partly_compiled;
function sized
  input Integer n;
  output R r;
protected
  R work[2] = {R(n), R(b = n)};
algorithm
  work[2].a := work[1].a + work[1].b;
  work[1] := R(1, 1);
  r := work[2];
  r.b := r.b + work[1].a;
end sized;
function as_sum
  input R r;
  input R more[:];
  output Integer y;
algorithm
  y := integer(r.a + 10*r.b + 100*sum(more.a) + 1000*more[end].b);
end as_sum;
function part_of
  input R r;
  output Integer n = integer(r.a);
end part_of;
model Run
  Real y = local(time);
  Real z = compiled(time);
  R r = partly(time);
  R c = partly_compiled(time);
  parameter R base = R(b = 5);
  parameter R list[2] = {base, R(2)};
  Real v[part_of(sized(3))] = fill(time, part_of(sized(3)));
  Real w[as_sum(sized(2), {R(), base, R(b = 1)})];
  Real u[as_sum(base, list)];
equation
  for i in 1:size(w, 1) loop
    w[i] = i*time;
  end for;
  for i in 1:size(u, 1) loop
    u[i] = i*time;
  end for;
  // expect: y @ 1 = 1 + 20 + 100 + 2000 + 5e4 + 4e5 + 7e6 + 2e7 + 2e8
  // expect: z @ 1 = 1 + 20 + 100 + 2000 + 5e4 + 4e5 + 7e6 + 2e7 + 2e8
  // expect: r.a @ 1 = 1
  // expect: r.b @ 1 = 1
  // expect: c.a @ 1 = 1
  // expect: c.b @ 1 = 10
  // expect: v[5] @ 1 = 1
  // absent: v[6]
  // expect: w[1334] @ 1 = 1334
  // absent: w[1335]
  // expect: u[2351] @ 1 = 2351
  // absent: u[2352]
end Run;
