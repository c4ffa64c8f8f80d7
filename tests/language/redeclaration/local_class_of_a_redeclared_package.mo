// Local classes that take what they are from a package that was redeclared for the instance are those of the redeclared one there.
package P
  package A
    constant Real k = 2;
    function j
      input Real x;
      output Real y = k*x;
    algorithm
    end j;
    type T = Real(start = k);
    record R
      Real v = k;
    end R;
    connector C
      Real e(start = k);
      flow Real f;
    end C;
    model M
      parameter Real c = 1;
      Real y = c*k*time;
    end M;
  end A;
  package B
    extends A(k = 3);
  end B;
  model Part
    replaceable package S = A;
    function j = S.j;
    function g
      extends S.j;
    end g;
    function h
      extends g;
    end h;
    model M = S.M;
    model N
      extends S.M;
    end N;
    model N2
      extends N(c = 10);
    end N2;
    model Holder
      model Deep
        extends S.M;
      end Deep;
      Deep deep;
    end Holder;
    record R = S.R;
    type T = S.T;
    connector C = S.C;
    package Q
      extends S;
      constant Real k2 = 2*k;
      function twice
        input Real x;
        output Real y = 2*S.j(x);
      algorithm
      end twice;
      model Own
        extends S.M;
      end Own;
    end Q;
    Real direct = S.j(time), function_alias = j(time), function_extends = g(time), function_extends_again = h(time);
    Real of_package = Q.j(time), constant_of_package = Q.k2, own_of_package = Q.twice(time);
    S.M model_direct;
    M model_alias;
    N model_extends;
    N2 model_extends_again;
    M several[2];
    Holder holder;
    Q.Own own;
    R record_alias;
    T type_alias(fixed = true);
    S.T type_direct(fixed = true);
  equation
    der(type_alias) = 0;
    der(type_direct) = 0;
  end Part;
  model Around
    replaceable package S = A;
    model Inside
      function j = S.j;
      model N
        extends S.M;
      end N;
      N n;
      Real y = j(time);
    end Inside;
    Inside inside;
    Part part(redeclare package S = S);
    Part parts[2](redeclare package S = S);
  end Around;
  model Heir
    extends Part(redeclare package S = B);
  end Heir;
end P;
model Run
  P.Part plain;
  P.Part p(redeclare package S = P.B);
  P.Part q[2](redeclare package S = P.B);
  P.Part r(redeclare package S = P.B, N2(c = 5));
  P.Around around(redeclare package S = P.B);
  P.Heir heir;
  // expect: plain.function_alias @ 1 = 2
  // expect: plain.model_extends_again.y @ 1 = 20
  // expect: plain.own_of_package @ 1 = 4
  // expect: p.direct @ 1 = 3
  // expect: p.function_alias @ 1 = 3
  // expect: p.function_extends @ 1 = 3
  // expect: p.function_extends_again @ 1 = 3
  // expect: p.of_package @ 1 = 3
  // expect: p.constant_of_package @ 1 = 6
  // expect: p.own_of_package @ 1 = 6
  // expect: p.model_direct.y @ 1 = 3
  // expect: p.model_alias.y @ 1 = 3
  // expect: p.model_extends.y @ 1 = 3
  // expect: p.model_extends_again.y @ 1 = 30
  // expect: p.several[2].y @ 1 = 3
  // expect: p.holder.deep.y @ 1 = 3
  // expect: p.own.y @ 1 = 3
  // expect: p.record_alias.v @ 1 = 3
  // expect: p.type_alias @ 1 = 3
  // expect: p.type_direct @ 1 = 3
  // expect: q[2].function_alias @ 1 = 3
  // expect: q[2].model_alias.y @ 1 = 3
  // expect: q[2].model_extends_again.y @ 1 = 30
  // expect: r.model_extends_again.y @ 1 = 15
  // expect: around.inside.n.y @ 1 = 3
  // expect: around.inside.y @ 1 = 3
  // expect: around.part.function_extends @ 1 = 3
  // expect: around.part.holder.deep.y @ 1 = 3
  // expect: around.parts[1].model_extends.y @ 1 = 3
  // expect: around.parts[2].type_alias @ 1 = 3
  // expect: heir.function_alias @ 1 = 3
  // expect: heir.model_extends_again.y @ 1 = 30
  // expect: heir.own_of_package @ 1 = 6
end Run;
