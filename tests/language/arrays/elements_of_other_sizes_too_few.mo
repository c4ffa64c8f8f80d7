model Run
  model Cell
    parameter Integer n = 1;
    Real x[n] = fill(time, n);
  end Cell;
  Cell c[3](n = {1, 2}); // error E0207: `c` has the sizes [3], but this value has [2]
end Run;
