model SemiLin
  Real m[2] = {time-0.5, 0.5-time};
  Real h[2] = semiLinear(m, {1,2}, {3,4});
  Real a = semiLinear(time-0.5, 2, 5);
  // expect: h[1] @ 1 = 0.5
  // expect: h[2] @ 1 = -2
  // expect: h[1] @ 0 = -1.5
  // expect: a @ 1 = 1
end SemiLin;
