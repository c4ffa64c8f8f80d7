// A package that is another name of one that was redeclared for an instance is the redeclared one there.
package P
  constant Real k = 5;
  model Q
    parameter Real x = 2;
  end Q;
  package Med
    constant Real k = 11; // warning W0202: `k` hides the constant `k`
    replaceable model S = Q(x = k);
  end Med;
  package Other
    constant Real k = 6; // warning W0202: `k` hides the constant `k`
    model S = Q(x = k);
  end Other;
  model Inner
    replaceable package M = Med;
    package A = M;
    M.S s;
    Real ak = A.k;
  end Inner;
  model U
    replaceable package M = Med;
    package N = M;
    package N2 = M(k = 3);
    package Again = N;
    N.S n;
    N2.S n2;
    Again.S again;
    Real nk = N.k;
    Real mk = M.k;
    Inner inner_one(redeclare package M = N);
  end U;
  model W = U(redeclare package M = Other);
end P;
model Run
  P.U u(redeclare package M = P.Other);
  P.W w;
  P.U plain;
  // expect: u.n.x @ 0 = 6
  // expect: u.n2.x @ 0 = 3
  // expect: u.again.x @ 0 = 6
  // expect: u.nk @ 1 = 6
  // expect: u.mk @ 1 = 6
  // expect: u.inner_one.s.x @ 0 = 6
  // expect: u.inner_one.ak @ 1 = 6
  // expect: w.n.x @ 0 = 6
  // expect: w.n2.x @ 0 = 3
  // expect: w.nk @ 1 = 6
  // expect: plain.n.x @ 0 = 11
  // expect: plain.n2.x @ 0 = 3
  // expect: plain.nk @ 1 = 11
  // expect: plain.inner_one.ak @ 1 = 11
end Run;
