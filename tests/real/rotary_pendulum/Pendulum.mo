model Pendulum "Pendulum of a rotary inverted pendulum, hanging and swinging freely"
  parameter Real J(unit = "kg.m2", min = 1e-9) = 1.33e-4 "moment of inertia about the pivot";
  parameter Real D(unit = "N.m", min = 1e-9) = 1.5e-2 "weight times distance of the centre of mass";
  parameter Real k(unit = "N.m.s/rad", min = 0) = 1e-5 "viscous friction of the bearing";
  Real theta(unit = "rad", start = 0, fixed = true) "angle from hanging";
  Real w(unit = "rad/s", start = 0, fixed = true) "speed";
equation
  der(theta) = w;
  J*der(w) = -D*sin(theta) - k*w;
end Pendulum;
