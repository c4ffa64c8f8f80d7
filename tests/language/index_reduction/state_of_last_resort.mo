// `phi` must be a state. Of `b` little is left beside `a`, but that is enough to make it follow from the others.
// stop: 2
model Run
  Real phi(start = 1, fixed = true, stateSelect = StateSelect.always); // expect: phi @ 2 = 0.1353352832366127
  Real a; // expect: a @ 2 = -6.902099445067248
  Real b; // expect: b @ 2 = 6.766764161830635
  Real f;
  Real g;
equation
  der(phi) = -phi;
  der(a) = f;
  der(b) = g;
  phi + a + b = 0;
  a + 1.02*b = 0;
end Run;
