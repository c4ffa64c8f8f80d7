// Clocked equations determine what is left to be determined, whichever side it stands on.
model Run
  Real a;
  Real b;
  Real c;
equation
  b + 2*a = 3*sample(time, Clock(0.25));
  a = c/4;
  0 = c - 8;
  // note: a = 2, b = 3*t - 4
  // expect: a @ 1 = 2
  // expect: b @ 0.6 = 3*0.5 - 4
end Run;
