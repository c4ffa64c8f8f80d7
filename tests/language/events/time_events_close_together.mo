// Instants closer together than any step are two events or one, but both relations change.
model M
  parameter Real t1 = 0.3;
  parameter Real t2 = 0.3;
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
  Real x(start = 0, fixed = true);
  Real y(start = 0, fixed = true);
  Real z = if time >= t2 then 1 else 0;
equation
  der(x) = 1;
  der(y) = if time > t2 then 1 else 0;
  when time >= t1 then
    n = pre(n) + 1;
  end when;
  when time >= t2 then
    m = pre(m) + 1;
    reinit(x, 0);
  end when;
  // set: t2 = 0.30000000000000054
  // expect: n @ 1 = 1
  // expect: m @ 1 = 1
  // expect: x @ 1 = 0.7
  // expect: y @ 1 = 0.7
  // expect: z @ 1 = 1
end M;
