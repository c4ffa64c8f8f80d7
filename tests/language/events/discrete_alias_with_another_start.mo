// Two discrete variables that are equal from the first event on may start differently: `pre` of each at the start is its own.
model Run
  Integer a(start = 1, fixed = true);
  Integer b(start = 5, fixed = true);
  Integer first(start = 0, fixed = true);
equation
  a = if time < 0.5 then 1 else 2;
  b = a;
  when initial() then
    first = 10*pre(a) + pre(b);
  end when;
  // expect: first @ 0.1 = 15
  // expect: b @ 0.1 = 1
  // expect: b @ 0.9 = 2
end Run;
