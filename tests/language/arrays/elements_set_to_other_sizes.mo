// Elements made different from outside, one by one and by a list.
// set: c[2].n = 3
// set: d.n = {2, 1}
// set: d.k = {5, 7}
model Run
  model Cell
    parameter Integer n = 1;
    parameter Real k = 1;
    Real x[n];
  equation
    x = fill(k*time, n);
  end Cell;
  Cell c[2];
  Cell d[2](k = {1, 2});
  Real s = sum(c[2].x);
  Real t = sum(d[1].x);
  Real u = sum(d[2].x);
  // expect: s @ 1 = 3
  // expect: t @ 1 = 10
  // expect: u @ 1 = 7
end Run;
