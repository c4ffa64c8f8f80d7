package P
  type Kind = enumeration(one, two);
  record Base
    Real x = 1;
    String name = "n";
    Kind kind = Kind.two;
    Boolean on = true;
    parameter Integer n = 2;
    Real v[n] = fill(x, n);
  end Base;
  replaceable record Data = Base(x = 3);
  function f
    input Data d;
    output Real y = d.x + sum(d.v);
  end f;
  model Uses
    replaceable record R = Base;
    R r = R();
    parameter R p = R(n = 3);
    Real s = sum(p.v);
  end Uses;
end P;
package Q
  extends P(redeclare record Data = P.Base(x = 5));
end Q;
record WithRep
  replaceable P.Base b;
  Real t = b.x;
end WithRep;
record Ext = P.Base(x = 50);
record WithNew = WithRep(redeclare Ext b(n = 1));
function g
  input WithRep w;
  output Real y = w.t;
end g;
function h
  input Real k;
  output P.Base b(x = k);
algorithm
end h;
function hh = h;
model Run
  Real a = P.f(P.Data());
  Real b = Q.f(Q.Data());
  P.Uses u(redeclare record R = P.Base(x = 7));
  parameter P.Base t = P.Base(n = 3, name = "hello");
  Real sv = sum(t.v);
  Real gb = g(WithRep());
  Real gc = g(WithNew());
  P.Base z = h(4);
  parameter P.Base list[3] = {P.Base(x = i) for i in 1:3};
  Real l = sum(list.x) + sum(list[3].v);
equation
  assert(t.name == "hello", "name " + t.name);
  assert(list[1].name == "n", "name " + list[1].name);
  // expect: a @ 1 = 9
  // expect: b @ 1 = 15
  // expect: u.r.x @ 1 = 7
  // expect: u.s @ 1 = 21
  // expect: sv @ 1 = 3
  // expect: gb @ 1 = 1
  // expect: gc @ 1 = 50
  // expect: z.x @ 1 = 4
  // expect: z.v[2] @ 1 = 4
  // expect: l @ 1 = 12
end Run;
