model Run
  model Cell
    parameter Integer n = 1;
    Real x[n] = fill(time, n);
  end Cell;
  Cell c[3](n = {1, 2, 3});
  Integer k = if time > 0.5 then 1 else 2;
  Real y = c[k].x[1]; // error E0206: the elements of `c` differ in structure: its subscripts must be known here
end Run;
