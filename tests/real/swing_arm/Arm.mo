model Arm "Pendulum arm on a bearing, swinging freely"
  parameter Real J(unit = "kg.m2", min = 1e-6) = 3.33e-3 "moment of inertia about the pivot";
  parameter Real m(unit = "kg") = 0.1476 "mass";
  parameter Real a(unit = "m", min = 1e-3) = 0.1478 "from the pivot to the centre of mass";
  parameter Real g(unit = "m/s2") = 9.81 "gravity";
  parameter Real k(unit = "N.m.s/rad", min = 0) = 2.2e-4 "viscous friction of the bearing";
  Real theta(unit = "rad", start = 0, fixed = true) "angle from hanging";
  Real w(unit = "rad/s", start = 0, fixed = true) "speed";
equation
  der(theta) = w;
  J*der(w) = -m*g*a*sin(theta) - k*w;
end Arm;
