// A steady state that a motor or a brake may hold, and nothing says which: the brake, which slips beyond a limit, stays as it starts.
model Run
  parameter Real most = 0.5;
  Real w(start = 0, fixed = true);
  Real q;
  Real a;
  Real s(start = 0);
  Real force;
  Boolean moves(start = false, fixed = true);
  Boolean slips;
  Boolean held;
initial equation
  der(w) = 0;
equation
  der(w) = a;
  der(q) = -w;
  0.1*a = 4*q - force - 8;
  slips = not pre(moves) and s > most;
  held = not (pre(moves) or slips);
  force = if held then s else most;
  a = if held then 0 else s - most;
  moves = (pre(moves) or slips) and w > 0;
end Run;
// expect: q @ 0 = 2
// expect: force @ 0 = 0 abs 1e-9
// expect: q @ 1 = 2
// expect: w @ 1 = 0 abs 1e-9
// stop: 1
