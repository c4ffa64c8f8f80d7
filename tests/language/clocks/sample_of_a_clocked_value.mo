model Run
  Real a;
  Real b;
equation
  a = sample(time, Clock(0.1));
  b = sample(a, Clock(0.2)); // error E0220: `sample` takes a value that holds at all times, but this has a clock
end Run;
