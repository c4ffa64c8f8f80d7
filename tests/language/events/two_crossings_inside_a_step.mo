// Relations of states that are true for much less than a step.
model M
  Real x(start = 1, fixed = true);
  Real y(start = 0, fixed = true);
  Integer a(start = 0, fixed = true);
  Integer b(start = 0, fixed = true);
  Integer c(start = 0, fixed = true);
  Integer d(start = 0, fixed = true);
equation
  der(x) = 100*y;
  der(y) = -100*x;
  when x > 0.99 then a = pre(a) + 1; end when;
  when abs(x) < 1e-3 then b = pre(b) + 1; end when;
  when x*y > 0.49 then c = pre(c) + 1; end when;
  when max(y - 0.5, 0.5 - y) < 1e-4 then d = pre(d) + 1; end when;
  // stop: 2
  // note: x is cos(100 t): near 2 pi k/100 for k = 1 to 31
  // expect: a @ 2 = 31
  // note: at (k + 1/2) pi/100 for k = 0 to 63
  // expect: b @ 2 = 64
  // note: -sin(200 t)/2 near (3/2 pi + 2 pi k)/200 for k = 0 to 62
  // expect: c @ 2 = 63
  // note: -sin(100 t) at (7/6 pi + 2 pi k)/100 for k = 0 to 31 and (11/6 pi + 2 pi k)/100 for k = 0 to 30
  // expect: d @ 2 = 63
end M;
