// A connector that is a scalar variable: elements of a vector of them, and the vector as a whole.
connector RealInput = input Real;
connector RealOutput = output Real;
connector Bus
  RealInput u[2];
end Bus;
block Source
  parameter Real k = 1;
  RealOutput y;
equation
  y = k*time;
end Source;
block Sum
  RealInput u[3];
  RealOutput y;
equation
  y = sum(u);
end Sum;
block Mux
  RealInput u[2];
  RealOutput y[2];
equation
  y = u;
end Mux;
model Run
  Source s[3](k = {1, 2, 3});
  Source one(k = 10);
  Sum a;
  Sum b;
  Mux m;
  Sum c;
equation
  connect(s[1].y, a.u[1]);
  connect(s[2].y, a.u[2]);
  connect(one.y, a.u[3]);
  connect(s.y, b.u);
  connect(a.y, m.u[2]);
  connect(one.y, m.u[1]);
  connect(m.y[1], c.u[2]);
  connect(m.y[2], c.u[1]);
  connect(c.u[3], b.y);
  // expect: a.y @ 1 = 13
  // expect: b.y @ 1 = 6
  // expect: c.y @ 1 = 29
end Run;
