// Two locked brakes on one mass: nothing says which of them carries how much, and it slips when both are at their limits.  The first one that
// is stays there while the other takes what is added.
model Run
  model Brake
    parameter Real most;
    input Real v;
    input Real a;
    Real s(start = 0);
    Real force;
    Boolean moves(start = false, fixed = true);
    Boolean slips;
    Boolean held;
  equation
    slips = not pre(moves) and s > most;
    held = not (pre(moves) or slips);
    force = if held then s else most;
    a = if held then 0 else s - most;
    moves = (pre(moves) or slips) and v > 0;
  end Brake;
  Real v(start = 0, fixed = true);
  Real a;
  Brake one(most = 1, v = v, a = a);
  Brake two(most = 2, v = v, a = a);
  Real both = one.force + two.force;
equation
  der(v) = a;
  2*a = time - both;
end Run;
// expect: both @ 1.5 = 1.5
// expect: both @ 2.9 = 2.9
// expect: v @ 2.9 = 0 abs 1e-9
// The load passes what both hold at 3 s: v = (t - 3)^2/4.
// expect: v @ 4 = 0.25
// expect: v @ 5 = 1
// stop: 5
