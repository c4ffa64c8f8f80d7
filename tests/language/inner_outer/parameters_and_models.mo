model InnerOuter
  model World
    parameter Real g = 9.81;
    Real T = 300 + time;
  end World;
  model Body
    outer World world;
    outer parameter Real scale;
    Real a = world.g*scale + world.T;
  end Body;
  model Sub
    inner parameter Real scale = 2;
    Body b[2];
  end Sub;
  inner World world(g = 10);
  inner parameter Real scale = 1;
  Sub s;
  Body b;
  function f
    input Real x; output Real y;
  algorithm
    y := x;
  end f;
  // expect: s.b[2].a @ 1 = 20 + 301
  // expect: b.a @ 1 = 311
end InnerOuter;
