// Relations of time alone change far more often than a slow state, or its output points, would show.
model M
  Integer n(start = 0, fixed = true);
  Integer c(start = 0, fixed = true);
  Integer p(start = 0, fixed = true);
  Integer w(start = 0, fixed = true);
  Integer s(start = 0, fixed = true);
  Integer a(start = 0, fixed = true);
  Integer e(start = 0, fixed = true);
  Integer f(start = 0, fixed = true);
  Real u = cos(500*time);
  Real v = u*u;
  Real x(start = 1, fixed = true);
equation
  der(x) = -1e-3*x;
  when sin(1000*time) > 0.5 then n = pre(n) + 1; end when;
  when u > 0.9999 then c = pre(c) + 1; end when;
  when v*sin(3*time) > 0.5 then p = pre(p) + 1; end when;
  when mod(time, 0.01) > 0.005 then w = pre(w) + 1; end when;
  when abs(sin(314*time)) < 1e-3 then s = pre(s) + 1; end when;
  when abs(time - 0.5) < 1e-6 then a = pre(a) + 1; end when;
  when exp(-1e8*(time - 0.3)^2) > 0.5 then e = pre(e) + 1; end when;
  when floor(10*sin(400*time)) > 8 then f = pre(f) + 1; end when;
  // note: asin(0.5)/1000 + 2 pi k/1000 up to 1 is k = 0 to 159
  // expect: n @ 1 = 160
  // note: 2 pi k/500 - acos(0.9999)/500 up to 1 is k = 1 to 79 (at the start it is true)
  // expect: c @ 1 = 79
  // note: cos(500 t)^2 is 1 at pi k/500, and sin(3 t) above 0.5 there for k = 28 to 138
  // expect: p @ 1 = 111
  // note: 0.01 k + 0.005 for k = 0 to 99
  // expect: w @ 1 = 100
  // note: pi k/314 - asin(0.001)/314 for k = 1 to 99 (the start is one already)
  // expect: s @ 1 = 99
  // expect: a @ 1 = 1
  // expect: e @ 1 = 1
  // note: sin above 0.9: asin(0.9)/400 + 2 pi k/400 for k = 0 to 63
  // expect: f @ 1 = 64
end M;
