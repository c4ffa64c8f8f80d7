// A pendulum that turns over, its direction held as sine and cosine of half the angle, as quaternions do: of both, and of their rates, one
// is a state for a part of the turn only. The angle itself, integrated beside it, is what they must agree with.
// stop: 3
model Run
  Real q(start = 1);
  Real p(start = 0, fixed = true);
  Real x;
  Real y;
  Real vx(start = 12, fixed = true);
  Real vy;
  Real force;
  Real phi(start = 0, fixed = true);
  Real rate(start = 6, fixed = true);
  Real off = p - sin(phi/2); // expect: off @ 3 = 0 abs 3e-4
  Real beside = q - cos(phi/2); // expect: beside @ 3 = 0 abs 3e-4
  Boolean twice = phi > 12.5663706; // expect: twice @ 3 = 1
equation
  p^2 + q^2 = 1;
  x = 4*p*q;
  y = -2*(q^2 - p^2);
  der(x) = vx;
  der(y) = vy;
  der(vx) = -force*x/2;
  der(vy) = -force*y/2 - 9.81;
  der(phi) = rate;
  der(rate) = -9.81/2*sin(phi);
end Run;
