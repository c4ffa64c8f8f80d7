// Where nothing flows, what is between two components is upstream of the flow (Modelica 3.6, section 3.7.2.5).
connector Port
  flow Real m;
  Real h;
  flow Real H;
end Port;
model Volume
  parameter Real h0;
  Real h(start = h0, fixed = true);
  Port port;
equation
  port.H = semiLinear(port.m, port.h, h);
  der(h) = port.H - h*port.m;
end Volume;
model Pump
  Port a;
  Port b;
  parameter Real sign = 1;
  Real h;
equation
  a.m + b.m = 0;
  a.H + b.H = 0;
  a.m = if time < 0.5 then 0 else sign*(time - 0.5);
  a.H = semiLinear(a.m, a.h, h);
  b.H = semiLinear(b.m, b.h, h);
end Pump;
model Run
  Volume left(h0 = 1);
  Volume right(h0 = 2);
  Pump pump;
  Volume top(h0 = 1);
  Volume low(h0 = 2);
  Pump back(sign = -1);
equation
  connect(left.port, pump.a);
  connect(pump.b, right.port);
  connect(top.port, back.a);
  connect(back.b, low.port);
  // der(h) = m*(1 - h) from 0.5 on, the integral of m is 1/8
  // expect: right.h @ 1 = 1 + exp(-1/8)
  // expect: left.h @ 1 = 1
  // expect: top.h @ 1 = 2 - exp(-1/8)
  // expect: back.h @ 1 = 2
end Run;
