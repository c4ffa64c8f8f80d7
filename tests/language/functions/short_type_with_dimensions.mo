// Inputs, outputs and local variables whose type is a short definition with dimensions of its own.
model Run
  type Vec = Real[3];
  type Rows = Vec[2];
  function doubled
    input Vec v;
    output Vec y;
  algorithm
    y := 2*v;
  end doubled;
  function multiples
    input Real s;
    output Vec y;
  protected
    Vec w;
  algorithm
    for i in 1:3 loop
      w[i] := s*i;
    end for;
    y := w;
  end multiples;
  function rows
    input Real s;
    output Rows y;
  algorithm
    for i in 1:2 loop
      y[i] := i*multiples(s);
    end for;
  end rows;
  Real a[3], b[3], c, d[2, 3];
equation
  a = doubled({time, 1, 2});
  b = multiples(time) + doubled(multiples(1));
  c = sum(multiples(time));
  d = rows(time);
  // expect: a[1] @ 1 = 2
  // expect: a[3] @ 1 = 4
  // expect: b[3] @ 1 = 9
  // expect: c @ 1 = 6
  // expect: d[2,3] @ 1 = 6
end Run;
