// The delay time is a time, and the delayed value has the unit of the value.
model Run
  Real u(unit = "m", start = 0, fixed = true);
  Real l(unit = "m") = 0.1 + 0.1*u;
  Real d(unit = "m") = delay(u, 0.3 + 0.2*time, 0.6);
  // error E0301: units do not fit: `bad` is kg, but `delay(u, 0.1*(1 + time), 0.6)` is m
  Real bad(unit = "kg") = delay(u, 0.1*(1 + time), 0.6);
  // error E0301: units do not fit: `delay(u, l, 0.6).time` is s, but `l` is m
  Real e = delay(u, l, 0.6);
equation
  der(u) = 1;
end Run;
