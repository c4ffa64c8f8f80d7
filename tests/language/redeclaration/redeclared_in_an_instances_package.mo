// What a short package in a model redeclares is read in the instance of that model, also where another component was handed the package.
package P
  package Med
    replaceable model S
      parameter Real x = 1;
    end S;
    replaceable function f
      input Real u;
      output Real y;
    protected
      constant Real x = 1;
    algorithm
      y := x*u;
    end f;
  end Med;
  model Q
    parameter Real x = 2;
  end Q;
  function g
    input Real u;
    input Real x = 3;
    output Real y;
  algorithm
    y := x*u;
  end g;
  model A
    constant Integer c = 1;
    package M = Med(redeclare model S = Q(x = c), redeclare function f = g(x = c));
    M.S s;
    Real v = M.f(time);
  end A;
  model B
    parameter Integer c = 1;
    package M = Med(redeclare model S = Q(x = c));
    model H
      replaceable package M2 = Med;
      M2.S s;
    end H;
    M.S s;
    H h(redeclare package M2 = M);
    H k(redeclare package M2 = Med(redeclare model S = Q(x = c)));
  end B;
end P;
model Run
  P.A plain;
  P.A a(c = 9);
  P.B b(c = 9);
  // expect: plain.s.x @ 0 = 1
  // expect: plain.v @ 1 = 1
  // expect: a.s.x @ 0 = 9
  // expect: a.v @ 1 = 9
  // expect: b.s.x @ 0 = 9
  // expect: b.h.s.x @ 0 = 9
  // expect: b.k.s.x @ 0 = 9
end Run;
