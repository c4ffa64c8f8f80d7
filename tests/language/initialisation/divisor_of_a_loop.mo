// A discrete variable that follows from what it divides has no value before it: a loop, which begins with the start value.
model Run
  Integer n = if y > 0 then 2 else 3;
  Real y = 1/n;
  // expect: n @ 0 = 2
  // expect: y @ 0 = 0.5
end Run;
