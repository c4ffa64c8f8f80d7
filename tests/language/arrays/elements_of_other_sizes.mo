// Parameters that decide sizes differ between the elements: each is a component of its own.
model Run
  model Cell
    parameter Integer n = 1;
    parameter Real k = 1;
    Real x[n](each start = 1, each fixed = true);
    Real u;
  equation
    for i in 1:n loop
      der(x[i]) = -k*i*x[i] + u;
    end for;
  end Cell;
  Cell c[3](n = {1, 2, 3}, k = {1, 2, 0});
  parameter Integer sizes[3] = {size(c[i].x, 1) for i in 1:3};
  parameter Integer all = sum(c.n);
  Real total = sum(sum(c[i].x) for i in 1:3);
  Real first[3] = c.x[1];
  Real last = c[end].x[end];
  Real two = sum(c[2:3].x[2]);
  Real s;
algorithm
  s := 0;
  for i in 1:3 loop
    for j in 1:size(c[i].x, 1) loop
      s := s + c[i].x[j];
    end for;
    if i == 2 then
      s := s + 100;
    end if;
  end for;
equation
  for i in 1:3 loop
    c[i].u = if i == 3 then 2 else 0;
  end for;
  // expect: c[1].x[1] @ 1 = exp(-1)
  // expect: c[2].x[2] @ 1 = exp(-4)
  // expect: c[3].x[3] @ 1 = 3
  // expect: sizes[3] @ 0 = 3
  // expect: all @ 0 = 6
  // expect: first[2] @ 1 = exp(-2)
  // expect: last @ 1 = 3
  // expect: two @ 1 = exp(-4) + 3
  // expect: total @ 1 = exp(-1) + exp(-2) + exp(-4) + 9
  // expect: s @ 1 = exp(-1) + exp(-2) + exp(-4) + 109
end Run;
