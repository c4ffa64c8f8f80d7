// Subscripts that time decides: integers change at events.
model Run
  parameter Real v[3] = {10, 20, 30};
  Real w[3] = {1, 2, 3}*time;
  Real y = v[integer(2*time) + 1];
  Real z = w[integer(2*time) + 1];
  Real u = v[if time > 0.7 then 3 else 2];
  // expect: y @ 0.25 = 10
  // expect: y @ 0.75 = 20
  // expect: y @ 1 = 30
  // expect: z @ 0.75 = 1.5
  // expect: u @ 1 = 30
end Run;
