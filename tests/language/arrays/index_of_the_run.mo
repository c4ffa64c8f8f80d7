// Subscripts that change during the run.
model TabIdx "time-varying index into array"
  parameter Real tab[5] = {1, 4, 9, 16, 25};
  parameter Real M[2,3] = [1,2,3;4,5,6];
  Integer k(start=1, fixed=true);
  Real y = tab[k];
  Real z = M[2, mod(k,3)+1];
  Real w[3] = {time, 2*time, 3*time};
  Real s = w[if k > 2 then 3 else 1];
equation
  when sample(0.2, 0.2) then
    k = min(pre(k) + 1, 5);
  end when;
  // expect: y @ 0.1 = 1
  // expect: y @ 0.5 = 9
  // expect: z @ 0.5 = 4
  // expect: s @ 0.3 = 0.3
  // expect: s @ 1 = 3
  // expect: y @ 1 = 25
end TabIdx;
