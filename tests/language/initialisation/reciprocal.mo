// What an unknown divides is multiplied by it: that is linear, and the start value 0 is as good as any other.
model Run
  Real r = 2 + sin(time);
  Real g;
equation
  r = 1/g;
  // expect: g @ 0 = 0.5
  // expect: g @ 1 = 1/(2 + sin(1))
end Run;
