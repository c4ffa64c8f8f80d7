model Run
  Real a;
equation
  a = sample(time, Clock(0.1)) + sample(time, Clock(0.2)); // error E0220: what has this clock already has another one
end Run;
