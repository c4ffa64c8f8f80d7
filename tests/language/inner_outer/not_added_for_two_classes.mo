// Where two classes are wanted under one name none can be added.
package P
  model World
    parameter Real g = 10;
  end World;
  model Other
    extends World;
  end Other;
  model Body
    outer World world;
    Real y = world.g;
  end Body;
  model Second
    outer Other world; // error E0201: no enclosing model declares `inner world`, which is wanted as `P.World` and as `P.Other`
    Real y = world.g;
  end Second;
  model Run
    Body a;
    Second b;
  end Run;
end P;
