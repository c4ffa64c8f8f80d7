record Core
  parameter Integer m = 1;
  parameter Real v = 1;
end Core;
model Machine
  parameter Core core(final m = 3, v = 2);
  Real x = core.m*time;
end Machine;
model Run
  parameter Core data(m = 4, v = 5);
  Machine machine(core = data); // error E0209: `m` is final and cannot be modified
end Run;
