// Identical elements of two bases count once (Modelica 3.6, section 7.1), and both bases see them.
partial model A
  parameter Real a = 1;
  constant Integer n = 2;
  Real x = a;
end A;
partial model B
  parameter Real a = 1;
  constant Integer n = 2;
  Real y = 2*a;
  Real v[n] = fill(a, n);
end B;
partial model Left
  extends A;
  Real l = a + x;
end Left;
partial model Right
  extends A;
  Real r = a + 2*x;
end Right;
model Both
  extends A;
  extends B(a = 1);
end Both;
model Diamond
  extends Left(a = 3);
  extends Right(a = 3);
end Diamond;
model Run
  Both b(a = 5);
  Diamond d;
  // expect: b.x @ 1 = 5
  // expect: b.y @ 1 = 10
  // expect: b.v[2] @ 1 = 5
  // expect: d.l @ 1 = 6
  // expect: d.r @ 1 = 9
end Run;
