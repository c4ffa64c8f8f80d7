// An `inner` component inside one model is not around others; those that have none get the added one.
package P
  model World
    parameter Real g = 10;
  end World;
  model Body
    outer World world; // warning W0204: no enclosing model declares `inner world`: `P.World` is added with its defaults
    Real y = world.g;
  end Body;
  model Moon
    inner World world(g = 1.6);
    Body body;
  end Moon;
  model Run
    Moon moon;
    Body body;
    // expect: moon.body.y @ 0 = 1.6
    // expect: body.y @ 0 = 10
  end Run;
end P;
