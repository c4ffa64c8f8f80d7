// An `outer` component that no enclosing model declares `inner` is added at the top, once for all that look for it.
package P
  model World
    parameter Real g = 9.81;
    annotation(missingInnerMessage = "No world is there, so gravity is that of the earth.");
  end World;
  model Ground
    extends World;
    Real level = 2;
  end Ground;
  record Settings
    parameter Real k = 4;
  end Settings;
  model Body
    // warning W0204: no enclosing model declares `inner world`: `P.World` is added with its defaults
    outer World world;
    Real v(start = 0, fixed = true);
  equation
    der(v) = world.g;
  end Body;
  model Heir
    extends Body;
  end Heir;
  model Holder
    Body bodies[2];
    // warning W0204: no enclosing model declares `inner settings`: `P.Settings` is added with its defaults
    outer parameter Settings settings;
    Real y = settings.k;
  end Holder;
  model Standing
    // warning W0204: no enclosing model declares `inner ground`: `P.Ground` is added with its defaults
    outer Ground ground;
    Real y = ground.level + ground.g;
  end Standing;
  model Optional
    parameter Boolean used = false;
    outer World no_world if used;
  end Optional;
  model Run
    Body a;
    Heir b;
    Holder h;
    Standing s;
    Optional o;
    // expect: a.v @ 1 = 9.81
    // expect: b.v @ 1 = 9.81
    // expect: h.bodies[2].v @ 1 = 9.81
    // expect: h.y @ 1 = 4
    // expect: s.y @ 1 = 11.81
    // expect: world.g @ 0 = 9.81
    // absent: no_world.g
  end Run;
end P;
