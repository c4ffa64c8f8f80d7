// `[A]` of an array with three dimensions is `A` (10.4.2).
model Run
  parameter Integer a[2, 1, 2] = [{{{1, 2}}, {{3, 4}}}];
  Real y = a[2, 1, 1];
  Real z[2, 1, 1] = [{{{time}}, {{2*time}}}];
  // expect: y @ 1 = 3
  // expect: z[2,1,1] @ 1 = 2
end Run;
