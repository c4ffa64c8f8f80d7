connector F
  Real r;
  flow Real f;
end F;
model Run
  F f;
equation
  Connections.uniqueRoot(f.r); // error E0102: `Connections.uniqueRoot` is outside the language profile
  f.f = 0;
end Run;
