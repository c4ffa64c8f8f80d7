// One class of which two things are said cannot be added as one element.
package P
  model World
    parameter Real g = 10;
  end World;
  model Body
    replaceable model W = World;
    outer W world; // error E0201: no enclosing model declares `inner world`, which is wanted as two classes that are both `P.World` by the text
    Real y = world.g;
  end Body;
  model Local
    model W
      parameter Real g = 10;
    end W;
    outer W ground; // error E0201: no enclosing model declares `inner ground`, which is wanted as two classes that are both `P.Local.W` by the text
    Real y = ground.g;
  end Local;
  package S1
    replaceable model K
      Real y = 1;
    end K;
  end S1;
  package S2
    extends S1;
    redeclare model K
      Real y = 50;
    end K;
  end S2;
  model Base
    replaceable package S = S1;
    model N
      extends S.K;
    end N;
    model User
      outer N n; // error E0201: no enclosing model declares `inner n`, which is wanted as two classes that are both `P.Base.N` by the text
      Real z = n.y;
    end User;
    User user;
  end Base;
  model Run
    Body a(redeclare model W = World(g = 1));
    Body b(redeclare model W = World(g = 2));
    Local c(W(g = 1));
    Local d(W(g = 2));
    Base e(redeclare package S = S2);
    Base f;
  end Run;
end P;
