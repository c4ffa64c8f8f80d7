model Pendulum "Pendulum with a motor in its joint"
  parameter Real J(unit = "kg.m2", min = 1e-4) = 0.13 "moment of inertia about the joint";
  parameter Real D(unit = "N.m", min = 1e-3) = 2.6 "weight times distance of the centre of mass";
  parameter Real b(unit = "N.m.s/rad", min = 0) = 0.05 "viscous friction";
  input Real tau(unit = "N.m") "torque of the motor";
  Real q(unit = "rad", start = 0, fixed = true) "angle from hanging";
  Real w(unit = "rad/s", start = 0, fixed = true) "speed";
equation
  der(q) = w;
  J*der(w) = tau - D*sin(q) - b*w;
end Pendulum;
