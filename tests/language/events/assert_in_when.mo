// An assertion in a `when` is judged at the event at which that fires.
model Run
  Real x(start = 0, fixed = true);
equation
  der(x) = 1;
  when time > 0.5 then
    assert(x > 3, "x is " + String(x, format = ".2f"));
  end when;
  annotation(experiment(StopTime = 1));
end Run;
// run error: x is 0.50
