// A start value that is not fixed is a guess: what an initial equation says of the value before the start holds.
model Run
  Boolean closed = time < 0.5;
  Boolean open(start = true) = not closed;
  Boolean opened(start = false, fixed = true);
  Integer count(start = 7) = if time < 0.25 then 1 else 2;
  Boolean warm(start = true);
  Boolean was = pre(warm);
  Real x(start = 3, fixed = true);
initial equation
  pre(open) = not closed;
  pre(count) = if closed then 1 else 5;
  pre(warm) = x > 5;
equation
  opened = pre(opened) or edge(open);
  warm = x > 2;
  der(x) = -1;
  // expect: opened @ 0 = 0
  // expect: opened @ 0.4 = 0
  // expect: opened @ 0.6 = 1
  // expect: count @ 0 = 1
  // expect: was @ 0 = 1
  // expect: was @ 0.6 = 1
end Run;
