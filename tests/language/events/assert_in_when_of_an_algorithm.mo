// The same in an algorithm, under a condition.
model Run
  Real x(start = 0, fixed = true);
  Integer n(start = 0, fixed = true);
equation
  der(x) = 1;
algorithm
  when sample(0.1, 0.1) then
    n := pre(n) + 1;
    if n > 3 then
      assert(x < 0.55, "beat " + String(n));
    end if;
  end when;
  annotation(experiment(StopTime = 1));
end Run;
// run error: beat 6
