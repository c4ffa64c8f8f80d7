// An array without elements has sizes in all its dimensions, before the run as during it.
package P
  function missing "One less of each row"
    input Real t[:];
    output Real y;
  protected
    Integer n = size(t, 1);
    Real[n - 1, n] a;
  algorithm
    for j in 1:n loop
      a[:, j] := cat(1, t[1:j - 1], t[j + 1:n]);
    end for;
    y := sum(a) + 10*size(a, 1) + size(a, 2);
  end missing;
  function all_true
    input Boolean v[:];
    output Boolean y;
  algorithm
    y := true;
    for i in 1:size(v, 1) loop
      y := y and v[i];
    end for;
  end all_true;
  function columns
    input Real a[:, :];
    output Integer n = size(a, 2);
  algorithm
  end columns;
  function scaled
    input Real a[:, :];
    output Real b[:, :] = 2*a;
  algorithm
  end scaled;
  model Part
    parameter Integer n = 0;
    input Boolean u[n];
    Boolean y = all_true(u);
    Boolean z = all_true(not u);
  end Part;
  model Element
    parameter Real table[:, :] = fill(0.0, 0, 2);
    final parameter Integer n = size(table, 2);
  end Element;
end P;
model Run
  parameter Real table[:, :] = fill(0.0, 0, 2);
  parameter Integer n = size(table, 2);
  parameter Real a[:, :] = zeros(0, 3);
  parameter Real b[2, 3] = [a; 1, 2, 3; 4, 5, 6];
  parameter Integer c[:] = 1:size(a, 2);
  parameter Real turned[:, :] = transpose(a);
  parameter Real deep[:, :, :] = fill(1.0, 2, 0, 4);
  parameter Real part[:, :] = deep[2, :, 2:3];
  parameter Real rows[:, :] = b[2:1, {1, 3}];
  parameter Real doubled[:, :] = 2*a + a/3 - (-a);
  parameter Real by_function[:, :] = P.scaled(a);
  parameter Real sines[:, :] = sin(a);
  parameter Real loops[:, :] = {{i + j for i in 1:2} for j in 1:0};
  parameter Real products[2, 3] = fill(1.0, 2, 0)*a;
  parameter Integer others = P.columns(a);
  parameter Real t[1] = {5};
  parameter Real k = P.missing(t);
  constant Real q = P.missing({5});
  P.Part p;
  P.Element own, others_table(table = [1, 2, 3]), several[2];
  Real y = n*time;
  Real z = (b[2, 3] + c[3])*time;
  Integer sizes[9] = {size(turned, 1), size(part, 2), size(rows, 2), size(doubled, 2), size(by_function, 2), size(sines, 2),
    size(loops, 2), size(deep, 3), size(part, 1)};
  // expect: n @ 0 = 2
  // expect: y @ 1 = 2
  // expect: z @ 1 = 9
  // expect: others @ 0 = 3
  // expect: k @ 0 = 1
  // expect: q @ 0 = 1
  // expect: p.y @ 1 = 1
  // expect: p.z @ 1 = 1
  // expect: own.n @ 0 = 2
  // expect: others_table.n @ 0 = 3
  // expect: several[2].n @ 0 = 2
  // expect: products[2,3] @ 0 = 0
  // expect: sizes[1] @ 0 = 3
  // expect: sizes[2] @ 0 = 2
  // expect: sizes[3] @ 0 = 2
  // expect: sizes[4] @ 0 = 3
  // expect: sizes[5] @ 0 = 3
  // expect: sizes[6] @ 0 = 3
  // expect: sizes[7] @ 0 = 2
  // expect: sizes[8] @ 0 = 4
  // expect: sizes[9] @ 0 = 0
end Run;
