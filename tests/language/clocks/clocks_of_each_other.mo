model Run
  Real a(start = 1);
  Real b(start = 1);
equation
  a = shiftSample(b, 1); // error E0220: nothing says when `b` ticks
  b = backSample(a, 1);
end Run;
