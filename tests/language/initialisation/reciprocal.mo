// What an unknown divides is multiplied by it: that is linear, and the start value 0 is as good as any other.
model Run
  Real r = 7e7*(2 + sin(time));
  Real g(nominal = 1e-8);
equation
  r = 1/g;
  // expect: g @ 0 = 1/14e7 rel 1e-5 abs 0
  // expect: g @ 1 = 1/7e7/(2 + sin(1)) rel 1e-5 abs 0
end Run;
