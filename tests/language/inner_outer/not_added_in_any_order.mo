// An element without `inner` around a component is said whether or not the element was added for another one before.
package P
  model World
    parameter Real g = 10;
  end World;
  model Body
    // warning W0204: no enclosing model declares `inner world`: `P.World` is added with its defaults
    outer World world; // error E0201: no enclosing model declares `inner world`
    Real y = world.g;
  end Body;
  model Holder
    World world(g = 3);
    Body b;
  end Holder;
  model Run
    Body a;
    Holder h;
  end Run;
end P;
