model Run
  model Cell
    parameter Integer n = 1;
    Real x[n];
  equation
    x = fill(time, n);
  end Cell;
  Cell c[2,3](n = {{1, 2, 3}, {4, 5, 6}});
  Real s = sum(sum(c[i,j].x) for i in 1:2, j in 1:3);
  Real first[2,3] = c.x[1];
  Real row[3] = c[2, :].x[1];
  Real t = sum(c[end, 2:end].x[end]);
  // expect: s @ 1 = 21
  // expect: first[2,3] @ 1 = 1
  // expect: row[3] @ 1 = 1
  // expect: t @ 1 = 2
end Run;
