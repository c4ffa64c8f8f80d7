// Where no variable declares a unit, a delay whose time varies brings none.
model Run
  Real z(start = 0, fixed = true);
  Real u = sin(3*time);
  Real d = delay(u, 0.3 + 0.2*time, 0.6);
  parameter Real T(unit = "s") = 0.1;
  Real e = delay(u, T + 0.1*time, 0.6);
  Real w(start = 0, fixed = true);
equation
  der(z) = -z + d;
  der(w) = -w + e;
  // expect: d @ 1 = sin(1.5) rel 1e-4
  // expect: e @ 1 = sin(2.4) rel 1e-4
end Run;
