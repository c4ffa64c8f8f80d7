// `sample` takes the value before the tick, also where the value jumps because of what is held from the same tick.
model Run
  Boolean y(start = false);
  Boolean u = hold(y);
  Real direct = 2*hold(s) + 1;
  Real s(start = 0);
equation
  y = not sample(u, Clock(1, 10));
  s = sample(direct, Clock(1, 10));
  // note: s is 1 at 0, then 2*1 + 1, 2*3 + 1, ...: 1, 3, 7, 15
  // expect: s @ 0.05 = 1
  // expect: s @ 0.15 = 3
  // expect: s @ 0.35 = 15
  // expect: direct @ 0.35 = 31
  // expect: y @ 0.05 = 1
  // expect: y @ 0.15 = 0
  // expect: y @ 0.25 = 1
end Run;
