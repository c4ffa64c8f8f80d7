model Run
  Real w = backSample(1, 4); // error E0220: nothing says when this ticks
end Run;
