// Each of these values is known once the one before it is.
model Run
  constant Integer N = 40;
  Integer k[N](each start = 0);
  Real r[N];
  Real x(start = 1, fixed = true);
equation
  k[1] = if time >= 0 then 1 else 0;
  for i in 2:N loop
    k[i] = if r[i - 1] > 0.5 then 1 else 0;
  end for;
  for i in 1:N loop
    r[i] = k[i];
  end for;
  der(x) = -x/k[N];
  // expect: x @ 1 = 0.367879441171442
end Run;
