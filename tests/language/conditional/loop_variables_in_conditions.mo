// A reduction declares its own loop variables, also in conditions.
model Run
  Real a = 1 + time;
  Integer n(start = 2, fixed = true);
  Real big = 100;
  Real y = if sum(k*a for k in 1:3) <= 7 then 1 else 2;
  Real z = if max({abs(j - 2)*a for j in 1:4}) > 3 then big else -big;
  Real v[3] = {if sum(i*j for j in 1:2) > 4 then 1 else 0 for i in 1:3};
  Real w[2];
equation
  for i in 1:2 loop
    w[i] = if i > 1 and product(k for k in 1:i) > 1 then time else big;
  end for;
  when time > 0.5 then
    n = if sum(i for i in 1:3) > pre(n) then 7 else 8;
  end when;
  // expect: y @ 0 = 1
  // expect: y @ 1 = 2
  // expect: z @ 0 = -100
  // expect: z @ 1 = 100
  // expect: v[1] @ 1 = 0
  // expect: v[2] @ 1 = 1
  // expect: w[1] @ 1 = 100
  // expect: w[2] @ 1 = 1
  // expect: n @ 1 = 7
end Run;
