// `time > 0` is false at 0 and true right after; a steady state of the start sees the former.
model M
  Boolean b = time > 0;
  Integer n(start = 0, fixed = true);
  discrete Real next(start = 0, fixed = true);
  Real u = if time > 0 then 1 else 0;
  Real x;
  Real lag;
  Boolean at_start(start = true, fixed = true);
  discrete Real u_at_start(start = 5, fixed = true);
initial equation
  der(x) = 0;
equation
  der(x) = u - x;
  der(lag) = (if 0 < time then 1 else 0) - lag;
  when time > pre(next) then
    next = pre(next) + 0.25;
    n = pre(n) + 1;
  end when;
  when {initial(), sample(0, 10)} then
    at_start = b;
    u_at_start = u;
  end when;
initial equation
  der(lag) = 0;
equation
  // note: at 1 `time > 1` is still false
  // expect: n @ 1 = 4
  // expect: n @ 0.9 = 4
  // expect: b @ 0.1 = 1
  // expect: at_start @ 1 = 0
  // expect: u_at_start @ 1 = 0
  // expect: x @ 1 = 1 - exp(-1)
  // expect: lag @ 1 = 1 - exp(-1)
end M;
