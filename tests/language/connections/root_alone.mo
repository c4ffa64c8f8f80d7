connector F
  Real r;
  flow Real f;
end F;
// A record that nothing is connected to can be a root (9.4).
model Body
  F f;
equation
  Connections.root(f.r);
  f.r = if Connections.isRoot(f.r) then 0 else time;
end Body;
model Run
  // warning W0301: nothing is connected to `b.f`, so nothing flows through it
  Body b;
  // expect: b.f.r @ 1 = 0
end Run;
