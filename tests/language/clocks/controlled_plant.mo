// A PI controller with a clock in closed loop with a plant: the sampled plant is known exactly.
model Run
  parameter Real T = 0.1;
  parameter Real Ti(unit = "s") = 1;
  Real x(start = 0, fixed = true);
  Real e;
  Real i(start = 0);
  Real u(start = 0);
equation
  der(x) = -x + hold(u);
  e = 1 - sample(x, Clock(T));
  when Clock() then
    i = previous(i) + e*interval(e);
    u = 2*e + 3*i/Ti;
  end when;
  // note: x(k+1) = a*x(k) + (1 - a)*u(k), a = exp(-0.1); i and u as above; worked out by hand for three ticks:
  // note: e0 = 1, i0 = 0.1, u0 = 2.3; x1 = (1 - a)*2.3; e1 = 1 - x1; i1 = 0.1 + 0.1*e1; u1 = 2*e1 + 3*i1; x2 = a*x1 + (1 - a)*u1
  // expect: u @ 0.05 = 2.3
  // expect: x @ 0.1 = (1 - exp(-0.1))*2.3
  // expect: u @ 0.15 = 2*(1 - (1 - exp(-0.1))*2.3) + 3*(0.1 + 0.1*(1 - (1 - exp(-0.1))*2.3))
  // expect: x @ 0.2 = exp(-0.1)*(1 - exp(-0.1))*2.3 + (1 - exp(-0.1))*(2*(1 - (1 - exp(-0.1))*2.3) + 3*(0.1 + 0.1*(1 - (1 - exp(-0.1))*2.3)))
end Run;
