model Part
  parameter Integer n = 1;
  Real a[n] = fill(1.0, n);
  Real u;
end Part;
model Run "The loop is written out for p; the branch that is not taken has subscripts outside"
  parameter Integer last = 4;
  Part p[3](n = {1, 2, 3}, u = {time, 2*time, 3*time});
  Real T[4];
equation
  for i in 1:4 loop
    T[i] = (if i > 1 then T[i - 1] else 0) + (if i < last then 0*T[i + 1] else 1) + p[2].u;
  end for;
  // expect: T[1] @ 1 = 2
  // expect: T[3] @ 1 = 6
  // expect: T[4] @ 1 = 9
end Run;
