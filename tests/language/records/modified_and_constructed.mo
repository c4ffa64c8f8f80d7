record R
  parameter Real a;
  parameter Real b = 2;
  parameter Real c = a + b;
end R;
model A
  parameter R r = R(a = 4);
  Real y = r.c;
end A;
model B
  extends A(r(a = 7, b = 5));
end B;
model C
  A a(r = R(a = 1));
  A b(r(b = 9));
  A d(r = R(1, 2, 3));
  A list[2](r = {R(10), R(20, c = 5)});
  A same[2](each r = R(a = 30));
end C;
model Run
  B b;
  C c;
  parameter R copy = c.b.r;
  parameter R arr[2](a = {1, 2}, each b = 10);
  parameter R other[2] = arr;
  Real o = other[2].c;
  Real p = copy.c;
  // expect: b.y @ 1 = 12
  // expect: c.a.y @ 1 = 3
  // expect: c.b.y @ 1 = 13
  // expect: c.d.y @ 1 = 3
  // expect: c.list[1].y @ 1 = 12
  // expect: c.list[2].y @ 1 = 5
  // expect: c.same[2].y @ 1 = 32
  // expect: o @ 1 = 12
  // expect: p @ 1 = 13
end Run;
