model Run
  Integer n(start = 0);
equation
  n = previous(n) + 1; // error E0220: nothing says when `n` ticks
end Run;
