// The condition of a `when` reads what the `when` sets, a Real without the prefix `discrete`.
model Run
  Real x = time;
  Real next;
  Boolean far = pre(next) > 0.8;
  discrete Real w(start = 0, fixed = true);
initial equation
  next = x + 0.3;
equation
  when {x >= pre(next), x < 0} then
    next = x + 0.3;
    w = pre(w) + 1;
  end when;
  // expect: w @ 0.2 = 0
  // expect: w @ 0.5 = 1
  // expect: w @ 1 = 3
  // expect: far @ 0.5 = 0
  // expect: far @ 0.7 = 1
end Run;
