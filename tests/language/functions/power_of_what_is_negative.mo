// A base below zero has powers with whole exponents only: while the exponent is zero, its slope by the exponent is zero.
model Run
  function friction
    input Real x;
    output Real y;
  protected
    Real a = 1/(1 + (x/100)^9);
  algorithm
    y := 4*x*log10(x/7)^(2*(a - 1));
  end friction;
  Real x(start = 0.001, fixed = true);
  Real y;
equation
  der(x) = y + 1;
  y = -friction(x);
  // expect: x @ 1 = 0.25 + (0.001 - 0.25)*exp(-4) rel 1e-5
end Run;
