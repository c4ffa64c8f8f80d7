// What an event sets is what the next one at the same time begins with.
model M
  Real x(start = 0, fixed = true);
  Real z(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
equation
  der(x) = 1;
  der(z) = if time > 0.3 then 1 else 0;
  when time >= 0.3 then
    m = pre(m) + 1;
    reinit(x, 0);
  end when;
  // expect: m @ 1 = 1
  // expect: x @ 1 = 0.7
  // expect: z @ 1 = 0.7
end M;
