// A connector inside a connector is connected by itself and with the whole: one set (9.2).
connector Heat
  Real T;
  flow Real Q;
end Heat;
connector Ports
  Heat a;
  Heat b;
end Ports;
model Loss
  Heat port;
  parameter Real k = 1;
equation
  port.Q = -k*time;
end Loss;
model Ambient
  Ports ports;
equation
  ports.a.T = 300;
  ports.b.T = 310;
end Ambient;
model Machine
  Ports inside;
  Loss one;
  Loss two(k = 2);
  Ambient ambient;
equation
  connect(one.port, inside.a);
  connect(two.port, inside.b);
  connect(ambient.ports, inside);
end Machine;
model Run
  // warning W0301: nothing is connected to `machine.inside.a`, `machine.inside.b`, so nothing flows through them
  Machine machine;
  // expect: machine.ambient.ports.a.Q @ 1 = 1
  // expect: machine.ambient.ports.b.Q @ 1 = 2
  // expect: machine.two.port.T @ 1 = 310
  // expect: machine.inside.a.Q @ 1 = 0
end Run;
