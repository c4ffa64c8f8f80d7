// What a redeclaration in a short definition says is read around it, not in the package that it makes.
package P
  constant Real k = 5;
  model Q
    parameter Real x = 2;
  end Q;
  package Med
    constant Real k = 11; // warning W0202: `k` hides the constant `k`
    replaceable model S = Q(x = k);
    replaceable function f
      input Real u;
      output Real y;
    algorithm
      y := u*k;
    end f;
  end Med;
  function g
    input Real u;
    input Real w = 1;
    output Real y;
  algorithm
    y := u*w;
  end g;
  package Short = Med(redeclare function f = g(w = k), redeclare model S = Q(x = k));
  package Long
    extends Med(redeclare function f = g(w = k), redeclare model S = Q(x = k));
  end Long;
  package Heir
    extends Short;
  end Heir;
end P;
model Run
  P.Short.S short;
  P.Long.S long;
  P.Heir.S heir;
  Real y = P.Short.f(1);
  Real z = P.Long.f(1);
  Real w = P.Heir.f(1);
  // expect: short.x @ 0 = 5
  // expect: long.x @ 0 = 11
  // expect: heir.x @ 0 = 5
  // expect: y @ 1 = 5
  // expect: z @ 1 = 11
  // expect: w @ 1 = 5
end Run;
