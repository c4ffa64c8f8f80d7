// What a `when initial()` sets has its value before the equations that divide by it are evaluated.
model Run
  discrete Real n;
  Real x(start = 1, fixed = true), y;
equation
  when {initial(), time > 0.5} then
    n = 2 + time;
  end when;
  y = 1/n;
  der(x) = -x*y;
  // expect: y @ 0 = 0.5
  // expect: x @ 0.5 = exp(-0.25)
  // expect: x @ 1 = exp(-0.25 - 0.2)
end Run;
