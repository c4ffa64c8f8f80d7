// A wheel comes to rest and is held: the force that holds it, not that with which it slid, says whether it slips again.  At 1 s it does.
model Run
  parameter Real J = 0.1;
  parameter Real most = 8;
  Real w(start = 2, fixed = true);
  Real a;
  Real s;
  Real force;
  Real drive = if time < 1 then -1 else 9;
  Boolean up;
  Boolean down;
  Boolean held;
  Integer mode(start = 1, fixed = true);
equation
  der(w) = a;
  J*a = drive - force;
  up = pre(mode) == 0 and (s > most or pre(up) and s > most);
  down = pre(mode) == 0 and (s < -most or pre(down) and s < -most);
  held = not (pre(mode) == 1 or up or pre(mode) == -1 or down);
  a = if held then 0 else if up then s - most else if down then s + most else if pre(mode) == 1 then s - most else s + most;
  force = if held then s else if up then most else if down then -most else if pre(mode) == 1 then most else -most;
  mode = if (pre(mode) == 1 or up) and w > 0 then 1 else if (pre(mode) == -1 or down) and w < 0 then -1 else 0;
  // expect: w @ 0.01 = 1.1
  // expect: w @ 0.5 = 0 +- 1e-9
  // expect: mode @ 0.5 = 0
  // expect: force @ 0.5 = -1
  // expect: w @ 2 = 10
  // expect: force @ 2 = 8
  // stop: 2
end Run;
