// Discrete variables that are equal from the first event on may start differently: `pre` of each at the start is its own.
model Run
  parameter Integer p = 4;
  Integer a(start = 1, fixed = true);
  Integer b(start = 5, fixed = true);
  Integer c(start = p, fixed = true);
  Integer first(start = 0, fixed = true);
equation
  a = if time < 0.5 then 1 else 2;
  b = a;
  c = b;
  when initial() then
    first = 100*pre(a) + 10*pre(b) + pre(c);
  end when;
  // expect: first @ 0.1 = 154
  // expect: c @ 0.1 = 1
  // expect: c @ 0.9 = 2
end Run;
