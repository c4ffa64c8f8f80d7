// Sub-, super- and shifted clocks of one base tick in the same pass of the same event; the first tick is at the start.
model Run
  Clock c = Clock(1, 10);
  Integer n(start = 0);
  Integer m;
  Integer k(start = 0);
  Integer late;
  Boolean first;
  Real d;
equation
  when c then
    n = previous(n) + 1;
    d = interval();
    first = firstTick();
  end when;
  m = subSample(n, 3);
  when superSample(c, 2) then
    k = previous(k) + 1;
  end when;
  late = shiftSample(n, 1, 2);
  // note: n ticks at 0, 0.1, 0.2, ...; m takes n at 0, 0.3, 0.6, 0.9; late at 0.05, 0.15, ...
  // expect: n @ 0.05 = 1
  // expect: n @ 0.55 = 6
  // expect: m @ 0.55 = 4
  // expect: m @ 0.95 = 10
  // expect: k @ 0.62 = 13
  // expect: late @ 0.62 = 6
  // expect: late @ 0.66 = 7
  // expect: d @ 0.5 = 0.1
end Run;
