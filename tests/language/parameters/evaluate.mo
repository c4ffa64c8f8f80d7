// A parameter with `Evaluate = true` decides which branch there is at all (18.3).
model Run
  parameter Boolean quasiStatic = true annotation(Evaluate = true);
  Real i, v, u = 10;
equation
  v = if quasiStatic then 0 else 2*der(i);
  u = v + 5*i;
  // expect: i @ 1 = 2
end Run;
