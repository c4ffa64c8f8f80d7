// `redeclare model extends N`: what `N` inherits from is what was redeclared for the instance.
package P
  package S1
    replaceable model K
      parameter Real b = 1;
      Real y = b;
    end K;
  end S1;
  package S2
    extends S1;
    redeclare model K
      parameter Real b = 1;
      Real y = 50*b;
    end K;
  end S2;
  model Base
    replaceable package S = S1;
    replaceable model N
      extends S.K;
    end N;
    replaceable model Short = S.K(b = 2);
    N n;
    Short s;
  end Base;
  model Heir
    extends Base;
    redeclare replaceable model extends N
      Real w = 2*y;
    end N;
    redeclare model extends Short
      Real v = 3*y;
    end Short;
  end Heir;
  model Second
    extends Heir;
    redeclare model extends N
      Real x = w + y;
    end N;
  end Second;
  model Run
    Heir plain;
    Heir a(redeclare package S = S2);
    Second b(redeclare package S = S2);
    Second c(redeclare package S = S2, N(b = 2));
    // expect: plain.n.y @ 0 = 1
    // expect: plain.n.w @ 0 = 2
    // expect: plain.s.v @ 0 = 6
    // expect: a.n.y @ 0 = 50
    // expect: a.n.w @ 0 = 100
    // expect: a.s.v @ 0 = 300
    // expect: b.n.x @ 0 = 150
    // expect: c.n.x @ 0 = 300
  end Run;
end P;
