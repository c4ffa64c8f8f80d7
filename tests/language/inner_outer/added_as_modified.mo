// An element is added as its class is modified where it is wanted, if all say the same; short names are no classes of their own.
package P
  model World
    parameter Real g = 10;
  end World;
  model Short = World;
  model Body
    replaceable model W = World;
    outer W world; // warning W0204: no enclosing model declares `inner world`: `P.World` is added as it is modified or redeclared around the `outer` element
    Real y = world.g;
  end Body;
  model A
    outer World ground; // warning W0204: no enclosing model declares `inner ground`: `P.World` is added with its defaults
    Real y = ground.g;
  end A;
  model B
    outer Short ground;
    Real y = ground.g;
  end B;
  model Run
    Body a(redeclare model W = World(g = 2));
    Body b(redeclare model W = Short(g = 2));
    A c;
    B d;
    // expect: a.y @ 0 = 2
    // expect: b.y @ 0 = 2
    // expect: world.g @ 0 = 2
    // expect: c.y @ 0 = 10
    // expect: d.y @ 0 = 10
  end Run;
end P;
