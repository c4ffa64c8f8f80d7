// A clock that ticks where a condition becomes true; what is true at the start ticks there.
model Run
  Real angle = 10*time;
  Real mark = hold(taken);
  Real taken(start = 0);
  Integer n(start = 0);
  Integer third;
  Real since;
  Integer at_start(start = 0);
equation
  when Clock(angle >= mark + 1) then
    taken = sample(angle);
    n = previous(n) + 1;
    since = interval();
  end when;
  third = subSample(n, 3);
  when Clock(angle < 5) then
    at_start = previous(at_start) + 1;
  end when;
  // note: ticks at 0.1, 0.2, ..., the interval of the first one is 0
  // expect: n @ 0.05 = 0
  // expect: n @ 0.55 = 5
  // expect: third @ 0.55 = 4
  // expect: since @ 0.15 = 0
  // expect: since @ 0.55 = 0.1 +- 1e-7
  // expect: at_start @ 1 = 1
end Run;
