// run error: the Integer `pre(a) + pre(b)` is beyond 2^53, from where on Integers are not exact
model Run
  Integer a(start = 1, fixed = true);
  Integer b(start = 1, fixed = true);
equation
  when sample(0.01, 0.01) then
    a = pre(b);
    b = pre(a) + pre(b);
  end when;
end Run;
