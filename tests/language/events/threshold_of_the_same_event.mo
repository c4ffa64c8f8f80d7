// A relation that reads what the same event sets means the new value; one that has a part in it keeps its own within the pass.
model Run
  Boolean armed = sample(1, 10) or pre(armed);
  discrete Real begin(start = 0, fixed = true);
  Boolean fire = armed and time >= begin + 0.5;
  discrete Real fired(start = -1, fixed = true);
  Integer n(start = 0, fixed = true);
  discrete Real next(start = 0.25, fixed = true);
equation
  when armed then
    begin = time;
  end when;
  when fire then
    fired = time;
  end when;
  when time >= next then
    next = pre(next) + 0.25;
    n = pre(n) + 1;
  end when;
  // stop: 2
  // expect: fired @ 1.4 = -1
  // expect: fired @ 2 = 1.5
  // expect: n @ 1.1 = 4
end Run;
