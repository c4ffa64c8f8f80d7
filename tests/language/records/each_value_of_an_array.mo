// A value that `each` gives to all elements of an array of records or components, read as a whole and in parts before the run.
package P
  record C
    Real m;
    Real k = 3;
    Integer w[2] = {1, 2};
  end C;
  model Part
    parameter Integer n = 2;
    parameter Real c[2] = {1, 2};
  end Part;
  constant C[2] water(each m = 18.0);
  constant C[2] other = water;
  model Run
    Real x[integer(other[1].m)] = fill(time, integer(other[1].m));
    Real y[integer(sum(water.m))] = fill(time, integer(sum(water.m)));
    Part p[3](each n = 4);
    Part q[2, 2](n = {{1, 2}, {3, 4}});
    Real z[sum(p.n)] = fill(time, sum(p.n));
    Real u[sum(p[2:3].n) + size(p.c, 1)] = fill(time, 11);
    Real v[sum(q[2, :].n)] = fill(time, 7);
    Real w[sum(q[:, 1].n) + sum(other.w[2])] = fill(time, 8);
    // expect: x[18] @ 1 = 1
    // expect: y[36] @ 1 = 1
    // expect: z[12] @ 1 = 1
    // expect: u[11] @ 1 = 1
    // expect: v[7] @ 1 = 1
    // expect: w[8] @ 1 = 1
  end Run;
end P;
