// Local classes that extend one that was redeclared, or modified, for the instance; what the redeclaration names is read around it.
package P
  model Base
    parameter Real a = 1;
    parameter Real b = 1;
    Real y = a + b;
  end Base;
  function f
    input Real x;
    output Real y = x;
  algorithm
  end f;
  model Part
    replaceable model M = Base;
    model N
      extends M(a = 10);
    end N;
    model Short = M(a = 10);
    replaceable function g = f;
    function h
      extends g;
    end h;
    type T = Real(start = 1);
    type T2 = T;
    N n;
    Short s;
    T2 t(fixed = true);
    Real z = h(2);
  equation
    der(t) = 0;
  end Part;
  model User
    replaceable package S = Empty;
    constant Real k = 100;
    model Own
      extends Base(b = S.k);
      Real w = S.k;
    end Own;
    function own
      input Real x;
      output Real y = S.k*x;
    algorithm
    end own;
    Part part(redeclare model M = Own, redeclare function g = own);
  end User;
  package Empty
    constant Real k = 7;
  end Empty;
  package Other
    constant Real k = 8;
  end Other;
end P;
model Run
  P.Part plain;
  P.Part modified(M(a = 2, b = 3), T(start = 5));
  P.User user;
  P.User other(redeclare package S = P.Other);
  // expect: plain.n.y @ 0 = 11
  // expect: plain.s.y @ 0 = 11
  // expect: plain.z @ 0 = 2
  // expect: modified.n.y @ 0 = 13
  // expect: modified.s.y @ 0 = 13
  // expect: modified.t @ 0 = 5
  // expect: user.part.n.y @ 0 = 17
  // expect: user.part.n.w @ 0 = 7
  // expect: user.part.s.y @ 0 = 17
  // expect: user.part.z @ 0 = 14
  // expect: other.part.n.y @ 0 = 18
  // expect: other.part.n.w @ 0 = 8
  // expect: other.part.s.w @ 0 = 8
  // expect: other.part.z @ 0 = 16
end Run;
