// The order of Booleans and of the literals of an enumeration (10.3.4).
model Run
  type E = enumeration(a, b, c);
  parameter E e[2] = {E.c, E.a};
  Boolean b[2] = {time > 0.5, time > 0.7};
  Boolean any = max(b);
  Boolean all = min(b);
  Real x = if any then 1 else 0;
  Real y = if all then 1 else 0;
  Real z = if max(e) == E.c and min(e) == E.a then 1 else 0;
  // expect: x @ 0.6 = 1
  // expect: y @ 0.6 = 0
  // expect: y @ 1 = 1
  // expect: z @ 1 = 1
end Run;
