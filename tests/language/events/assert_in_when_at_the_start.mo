// A `when` that fires at the start.
model Run
  Real x(start = 0, fixed = true);
equation
  der(x) = 1;
  when {initial(), x > 2} then
    assert(x > 0, "x begins with " + String(x));
  end when;
  annotation(experiment(StopTime = 1));
end Run;
// run error: x begins with 0
