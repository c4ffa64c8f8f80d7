model NestedArr
  model Cell
    parameter Real k = 1;
    parameter Real w[2] = {1, 2};
    Real y = k*w[1] + w[2];
  end Cell;
  model Row
    parameter Integer m = 2;
    Cell c[m](k = 1:m);
  end Row;
  Row r[3](each m = 2, c(each w = {10, 20}));
  Row q[2](c(k = {{1, 2}, {3, 4}}));
  Row s(m = 3, c(k = {5, 6, 7}, w = {{1,1},{2,2},{3,3}}));
  Real t = sum(r.c.y);
  // expect: r[3].c[2].y @ 1 = 40
  // expect: q[2].c[1].y @ 1 = 5
  // expect: s.c[3].y @ 1 = 24
  // expect: t @ 1 = 3*(30+40)
end NestedArr;
