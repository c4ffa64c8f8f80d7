model Run "3.6.5: a branch that is not taken is not evaluated"
  Real T[2] = {time, 2*time};
  Real y = if 1 > 2 then T[0] elseif 2 == 2 then T[2] else T[3];
  // expect: y @ 1 = 2
end Run;
