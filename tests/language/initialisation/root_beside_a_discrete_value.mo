// The equation of the start is solved with the discrete value that holds there: with 0 it would lead from the guess to the other root.
model Run
  Integer n = if time >= 0 then 3 else 1;
  Real x(start = 2);
equation
  (x - n)*(x + 1) = 0;
  // expect: x @ 0 = 3
  // expect: x @ 1 = 3
end Run;
