// Of two solutions of the equations the initial equation wants the one that the start value does not lead to.
// run error: contradicts the equations of the model, which give 2 on its left-hand and -2 on its right-hand side
model Run
  Real x(start = 1);
initial equation
  x = -2;
equation
  x^2 = 4;
  // note N0401 without line: the initial equation `x = -2` is not needed to determine the start, and is only checked
end Run;
