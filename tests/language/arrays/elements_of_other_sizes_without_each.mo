model Run
  model Cell
    parameter Integer n = 1;
    parameter Real k = 1;
    Real x[n] = fill(k, n);
  end Cell;
  Cell c[3](n = {1, 2, 3}, k = 2); // error E0207: the value of `c.k` has the wrong size: scalar instead of [3]
end Run;
