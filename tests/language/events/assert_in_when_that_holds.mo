// It is judged with the values that the event leads to, and at no other time.
model Run
  Real x(start = 0, fixed = true);
  Real y = 2*n + x;
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
equation
  der(x) = 1;
  when time > 0.5 then
    n = pre(n) + 1;
    assert(y > 2.4 and y < 2.6, "y is " + String(y));
  elsewhen time > 0.7 then
    n = pre(n) + 10;
    assert(y > 22.6, "y is " + String(y) + " then");
  end when;
  when initial() then
    assert(x < 0.1, "x begins with " + String(x));
  end when;
  when {x > 0.2, time > 0.8} then
    m = pre(m) + 1;
    assert(if m == 1 then x < 0.3 else x > 0.7, "beat " + String(m));
  end when;
  // expect: n @ 1 = 11
  // expect: m @ 1 = 2
  annotation(experiment(StopTime = 1));
end Run;
