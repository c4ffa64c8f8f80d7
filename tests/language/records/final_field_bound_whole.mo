// A record bound as a whole may not give a final field another value (7.2.6).
record Core
  parameter Integer m = 1;
  parameter Real v = 1;
end Core;
model Machine
  parameter Core core(final m = 3, v = 2);
  Real x[core.m] = fill(core.v*time, core.m);
end Machine;
model Run
  parameter Core data(m = 3, v = 5);
  Machine machine(core = data);
  // expect: machine.x[3] @ 1 = 5
end Run;
