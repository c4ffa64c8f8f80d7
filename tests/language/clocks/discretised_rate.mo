// A continuous equation in a partition with a solver method is integrated from tick to tick.
model Run
  Real x(start = 1);
  Real z(start = 1);
  Real w(start = 1);
equation
  when Clock(Clock(1, 10), solverMethod = "ExplicitEuler") then
    der(x) = -x;
  end when;
  when Clock(Clock(1, 10), "ImplicitEuler") then
    der(z) = -z;
  end when;
  when Clock(Clock(1, 10), "ImplicitTrapezoid") then
    der(w) = -w;
  end when;
  // note: at the first tick x is its start; explicit (1 - h)^k, implicit 1/(1 + h)^k, trapezoidal ((1 - h/2)/(1 + h/2))^k
  // expect: x @ 0.05 = 1
  // expect: x @ 0.55 = 0.9^5
  // expect: z @ 0.55 = 1/1.1^5
  // expect: w @ 0.55 = (0.95/1.05)^5
end Run;
