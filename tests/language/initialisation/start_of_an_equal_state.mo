// The relative speed is a state by wish and not fixed: that of the mass, which is its opposite, is, and starts both.
model Run
  Real s(start = 3, fixed = true);
  Real v(start = 10, fixed = true);
  Real gap(start = 0, stateSelect = StateSelect.prefer);
  Real relative(start = 0, stateSelect = StateSelect.prefer);
equation
  v = der(s);
  der(v) = 25*relative;
  gap = 4.5 - s;
  relative = der(gap);
  // expect: relative @ 0 = -10
  // expect: v @ 0.1 = 0.8208499862
end Run;
