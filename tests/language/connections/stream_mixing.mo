// What flows in is what the others let out, mixed (Modelica 3.6, section 15.2).
connector Port
  Real p;
  flow Real m;
  stream Real h;
  stream Real X[2];
end Port;
model Source
  parameter Real m = 1;
  parameter Real h = 1;
  Port port;
  Real inside = inStream(port.h);
  Real actual = actualStream(port.h);
equation
  port.m = -m;
  port.h = h;
  port.X = {h, 2*h};
end Source;
model Sink
  Port port;
  Real h = inStream(port.h);
  Real X[2] = inStream(port.X);
  Real actual = actualStream(port.h);
equation
  port.p = 0;
  port.h = 100;
  port.X = {100, 100};
end Sink;
// A component of components: its connectors pass through.
model Around
  parameter Real h = 3;
  Port port;
  Source a(m = 1, h = h);
  Source b(m = 2, h = 2*h);
equation
  connect(a.port, port);
  connect(b.port, port);
end Around;
model Run
  Source one(h = 7);
  Sink two;
  Source a(m = 1, h = 1);
  Source b(m = 3, h = 2);
  Sink c;
  Around around;
  Sink d;
  Source from(m = -2, h = 5);
  Source more(m = 4, h = 6);
  Sink e;
equation
  connect(one.port, two.port);
  connect(a.port, c.port);
  connect(b.port, c.port);
  connect(around.port, d.port);
  connect(from.port, e.port);
  connect(more.port, e.port);
  // expect: two.h @ 1 = 7
  // expect: two.X[2] @ 1 = 14
  // expect: one.inside @ 1 = 100
  // expect: two.actual @ 1 = 7
  // expect: one.actual @ 1 = 7
  // expect: c.h @ 1 = 7/4
  // nothing but the sink could flow back
  // expect: d.h @ 1 = 5
  // expect: d.X[2] @ 1 = 10
  // expect: around.port.h @ 1 = 5
  // expect: e.h @ 1 = 6
  // expect: from.inside @ 1 = 6
  // expect: from.actual @ 1 = 6
end Run;
