// A value before the start that is known late decides what the initial system is: it is solved again.
model Run
  Real x(start = 0);
  Boolean warm = time >= 0;
  Boolean hot(start = true) = x > 20;
initial equation
  pre(hot) = not warm;
  x = if pre(hot) then 30 else 10;
equation
  der(x) = 0;
  // expect: x @ 0 = 10
  // expect: hot @ 1 = 0
end Run;
