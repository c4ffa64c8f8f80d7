model Run
  Real a = hold(b);
  Real b;
equation
  b = sample(time, Clock(0.0)); // error E0217: the interval of a clock is 0 s, and must be positive
end Run;
