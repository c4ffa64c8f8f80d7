// In loops and arrays each connector has its own stream; a connector that nothing can leave does not mix.
connector Port
  Real p;
  flow Real m;
  stream Real h;
end Port;
model Cell
  Port a;
  Port b;
  Real h(start = 0, fixed = true);
equation
  a.p = b.p;
  a.m + b.m = 0;
  a.h = h;
  b.h = h;
  der(h) = a.m*actualStream(a.h) + b.m*actualStream(b.h);
end Cell;
model Source
  Port port;
equation
  port.m = -1;
  port.h = 1;
end Source;
model Sink
  Port port;
equation
  port.p = 0;
  port.h = 0;
end Sink;
model Sensor
  Port port(m(min = 0));
  Real h = inStream(port.h);
equation
  port.m = 0;
  port.h = 1000;
end Sensor;
model Tee
  Port ports[3];
  Real in_[3];
equation
  for i in 1:3 loop
    in_[i] = inStream(ports[i].h);
    ports[i].h = 10*i;
  end for;
  ports[1].p = 0;
  ports[2].p = ports[1].p;
  ports[3].p = ports[1].p;
end Tee;
model Run
  parameter Integer n = 3;
  Source source;
  Cell cell[n];
  Sink sink;
  Sensor sensor;
  Tee tee;
  Source s[3];
equation
  connect(source.port, cell[1].a);
  for i in 1:n - 1 loop
    connect(cell[i].b, cell[i + 1].a);
  end for;
  connect(cell[n].b, sink.port);
  connect(cell[1].b, sensor.port);
  connect(s.port, tee.ports);
  // cells in a row: the step answers of a chain of first orders
  // expect: cell[1].h @ 1 = 1 - exp(-1)
  // expect: cell[2].h @ 1 = 1 - 2*exp(-1)
  // expect: cell[3].h @ 1 = 1 - 2.5*exp(-1)
  // expect: sensor.h @ 1 = 1 - exp(-1)
  // expect: tee.in_[3] @ 1 = 1
end Run;
