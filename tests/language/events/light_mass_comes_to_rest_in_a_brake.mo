// A mass so light that the brake's force decides everything: one that slips the other way would be faster by far, one that is held does not
// move, and in between lies the force that holds it.
model Run
  parameter Real J = 0.0013;
  parameter Real most = 0.5;
  parameter Real drive = 0.498;
  Real w(start = 10, fixed = true);
  Real phi(start = 0, fixed = true);
  Real a;
  Real s;
  Real force;
  Boolean up;
  Boolean down;
  Boolean held;
  Integer mode(start = 1, fixed = true);
equation
  der(phi) = w;
  der(w) = a;
  J*a = drive - force;
  up = pre(mode) == 0 and s > most;
  down = pre(mode) == 0 and s < -most;
  held = not (pre(mode) == 1 or up or pre(mode) == -1 or down);
  a = if held then 0 else if up or pre(mode) == 1 then s - most else s + most;
  force = if held then s else if up or pre(mode) == 1 then most else -most;
  mode = if (pre(mode) == 1 or up) and w > 0 then 1 else if (pre(mode) == -1 or down) and w < 0 then -1 else 0;
end Run;
// It slows down by 0.002/0.0013 and stands after 6.5 s and 32.5 rad.
// expect: w @ 3.25 = 5
// expect: w @ 10 = 0 abs 1e-9
// expect: phi @ 10 = 32.5
// expect: force @ 10 = 0.498
// expect: phi @ 20 = 32.5
// stop: 20
