// What a logarithm is known of follows from it, without an iteration that would have to start somewhere.
model Run
  Real ratio = v/3 "without a start value: an iteration would begin at zero";
  Real decades = w/2;
  Real v;
  Real w;
  Real root = 1/v + 1/w;
equation
  log(ratio) = 2*time;
  time - log10(decades) = 1;
  // expect: v @ 1 = 3*exp(2)
  // expect: w @ 1 = 2
  // expect: root @ 1 = 1/(3*exp(2)) + 0.5
end Run;
