// Divisors that relations of continuous variables decide, one after the other: of an assigned one, of what is divided by it, and of an
// unknown of a loop.
model Run
  Real u = time + 1;
  Integer n = if u > 0.5 then 2 else 0;
  Real w = 1/n;
  Integer m = if w < 1 then 4 else 0;
  Real z(start = 1);
  Integer l = if z > 1.5 then 5 else 0;
  Real x(start = 1, fixed = true), y(start = 1, fixed = true);
equation
  z^3 + z = 10;
  der(x) = -x/m;
  der(y) = -y/l;
  // expect: n @ 0 = 2
  // expect: x @ 1 = exp(-0.25)
  // expect: y @ 1 = exp(-0.2)
end Run;
