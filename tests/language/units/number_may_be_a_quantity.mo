// A number that is a factor may stand for a quantity that nobody has named: what would fit then is a warning.
model Run
  parameter Real P(unit = "W") = 600;
  Real p(unit = "W") = P*min(1, time/10); // warning E0301: units do not fit: `p` is W, but `P*min(1, time/10)` is J
  Real u(unit = "V") = 10*sin(100*time); // warning E0301: units do not fit: `u` is V, but `10*sin(100*time)` is 1
  Real h(unit = "m", start = 1, fixed = true);
equation
  der(h) = -0.5*h; // warning E0301: units do not fit: `der(h)` is m/s, but `-0.5*h` is m
  // expect: p @ 1 = 60
end Run;
