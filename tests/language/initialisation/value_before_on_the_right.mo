// An initial equation has no direction; what reads its own value from before is no `when`; and a parameter may be found beside it.
model Run
  parameter Integer k(fixed = false);
  Boolean closed = time < 0.5;
  Boolean a(start = true) = time > 2;
  Integer opened(start = 0, fixed = true) = if not pre(a) and time < 1 then 1 else 0;
  Real x(start = 3, fixed = true);
  Boolean on(start = false) = pre(on) and x > 4;
  Boolean fell = not on and pre(on);
  Integer falls(start = 0, fixed = true) = if fell then pre(falls) + 1 else pre(falls);
  Integer n(start = 0) = if time > 2 then 1 else k;
  Integer before(start = 0) = pre(n);
  Integer most(start = 0, fixed = true) = max(pre(most), before);
initial equation
  not closed = pre(a);
  pre(on) = closed;
  pre(n) = k + 1;
  k = 3;
equation
  der(x) = -1;
  // expect: opened @ 0 = 1
  // expect: falls @ 1 = 1
  // expect: k @ 0 = 3
  // expect: n @ 1 = 3
  // expect: most @ 1 = 4
end Run;
