// Factors that are left out follow from the clocks of both sides, and clocks follow backwards through factors that are given.
model Run
  Integer fast(start = 0);
  Integer slow(start = 0);
  Real taken;
  Real repeated;
  Integer n(start = 0);
  Integer back(start = 0);
  Integer source(start = 0);
equation
  when Clock(2, 100) then
    fast = previous(fast) + 1;
  end when;
  when Clock(1, 10) then
    slow = previous(slow) + 1;
    taken = subSample(fast);
  end when;
  when Clock(1, 20) then
    repeated = superSample(slow) + 0.1*n;
    n = previous(n) + 1;
  end when;
  // note: `source` has no clock of its own: it ticks five times as often as `back`
  source = previous(source) + 1;
  when Clock(1, 2) then
    back = subSample(source, 5);
  end when;
  // expect: taken @ 0.35 = 16
  // expect: repeated @ 0.33 = 4.7
  // expect: source @ 0.35 = 4
  // expect: back @ 0.95 = 6
end Run;
