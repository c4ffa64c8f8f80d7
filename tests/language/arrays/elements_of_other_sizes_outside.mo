model Run
  model Cell
    parameter Integer n = 1;
    Real x[n] = fill(time, n);
  end Cell;
  Cell c[3](n = {1, 2, 3});
  Real y = c[4].x[1]; // error E0207: subscript 4 of `c` is outside 1..3
end Run;
