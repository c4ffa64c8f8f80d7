// Periodic clocks begin to tick where the run begins.
model Run
  Integer n(start = 0);
  Real t;
equation
  when Clock(0.5) then
    n = previous(n) + 1;
  end when;
  t = sample(time) + n;
  // expect: n @ 1.2 = 3
  // expect: t @ 1.2 = 4
  annotation(experiment(StartTime = 0, StopTime = 2));
end Run;
