// What a `when initial()` reads of a loop comes to rest, although every solution of the loop differs in its last digits.
model Run
  Real x(start = 0.17, fixed = true);
  Real c[6];
  discrete Real h(start = 0.5, fixed = true), g(start = 0, fixed = true);
equation
  der(x) = 0;
  2.5*c[1] = c[2] + 0.1;
  2.5*c[6] = c[5] + x;
  for i in 2:5 loop
    3*c[i] - c[i - 1] - c[i + 1] = cos(2) + x;
  end for;
  when {sample(0.1875, 0.09375), initial()} then
    h = c[2];
  end when;
  when initial() then
    g = c[2] - c[3];
  end when;
  // by Gaussian elimination of the six equations
  // expect: h @ 0 = -0.156062330056469
  // expect: g @ 0 = 0.0435528915432
  // expect: h @ 0.5 = -0.156062330056469
end Run;
