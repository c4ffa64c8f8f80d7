// A current that follows its source within picoseconds: its rate is the last bits of two large numbers, and swings on the way through a long
// step. The branches by its sign, as in the hysteresis of iron, are nearly alike.
// stop: 0.9
model Run
  parameter Real tau = 3e-13;
  Real u = 200*sin(6*time) + 20*sin(50*time);
  Real i(start = 0, fixed = true); // expect: i @ 0.5 = 25.576966610017983 rel 1e-3
  Real b(start = 0, fixed = true);
  Boolean up; // expect: up @ 0.1 = 1
  Boolean down = not up; // expect: down @ 0.5 = 1
equation
  tau*der(i) = u - i - 1e-10*der(b);
  up = der(i) > 0;
  der(b) = (if up then 0.01*(1.5 - b) else 0.02*(b + 1.5))*der(i)/(1 + i^2);
end Run;
