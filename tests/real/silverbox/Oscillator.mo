model Oscillator "Mass, damper and spring under a force, as the circuit stands for them: 1 V is 1 m and 1 N"
  parameter Real m(unit = "kg", min = 1e-9) = 1e-5 "moving mass";
  parameter Real d(unit = "N.s/m", min = 0) = 2e-4 "damper";
  parameter Real k(unit = "N/m", min = 1e-3) = 1 "spring";
  input Real u(unit = "N") "force";
  Real y(unit = "m", start = 0, fixed = true) "position";
  Real v(unit = "m/s", start = 0, fixed = true) "speed";
equation
  der(y) = v;
  m*der(v) = u - d*v - k*y;
end Oscillator;
