// A function that is an element of a component reads the component (5.3.2).
model World
  parameter Real g = 9.81;
  replaceable function gravity = constantGravity(g = 2*g);
end World;
function constantGravity
  input Real r;
  input Real g;
  output Real a = -g + 0*r;
end constantGravity;
function other
  input Real r;
  input Real g = 7;
  output Real a = r + g;
end other;
model Body
  outer World world;
  Real a = world.gravity(time);
end Body;
model Run
  inner World world(g = 3);
  World near(redeclare function gravity = other(g = 5));
  Body body;
  Real b = near.gravity(time);
  // expect: body.a @ 1 = -6
  // expect: b @ 1 = 6
end Run;
