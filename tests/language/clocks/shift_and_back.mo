// A shifted clock that comes back meets the first one; before the first tick of its source the start value counts.
model Run
  Integer n(start = 0);
  Integer late(start = 7);
  Integer early;
equation
  when Clock(1, 10) then
    n = previous(n) + 1;
  end when;
  late = shiftSample(n, 4, 1);
  early = backSample(late, 4, 1);
  // expect: late @ 0.35 = 7
  // expect: late @ 0.45 = 5
  // expect: early @ 0.25 = 7
  // expect: early @ 0.45 = 5
end Run;
