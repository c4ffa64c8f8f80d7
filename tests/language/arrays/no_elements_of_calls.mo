// A function that is called for the elements of an array without elements gives an array of the sizes that its outputs have.
package P
  function two
    input Real a[:];
    output Real y[2] = {sum(a), 1};
  algorithm
  end two;
  function same
    input Real a[:];
    output Real y[size(a, 1), 3];
  algorithm
    y := fill(a[1], size(a, 1), 3);
  end same;
  model Run
    parameter Real z[:, :] = two(zeros(0, 4));
    Integer s[2] = {size(z, 1), size(z, 2)};
    Real u[0, 4] = fill(time, 0, 4);
    Real v[0, 2] = two(u);
    Real w[:, :] = two(u);
    Integer t[2] = {size(w, 1), size(w, 2)};
    parameter Real x[:, :, :] = same(zeros(0, 4));
    parameter Integer r[3] = size(x);
    Real o[:, :, :] = same(u);
    Integer q[3] = size(o);
    // expect: s[1] @ 0 = 0
    // expect: s[2] @ 0 = 2
    // expect: t[2] @ 0 = 2
    // expect: r[2] @ 0 = 4
    // expect: r[3] @ 0 = 3
    // expect: q[1] @ 0 = 0
    // expect: q[2] @ 0 = 4
    // expect: q[3] @ 0 = 3
  end Run;
end P;
