model Mats
  Real A[3,3] = [2, 1, 0; 1, 3, 1; 0, 1, 4];
  Real b[3] = {1, 2, 3};
  Real x[3];
  Real n2 = x*x;
  Real T[2,3] = A[1:2, :];
  Real c[2] = T*x;
  Real tr = sum(A[i,i] for i in 1:3);
  Real m = max(A);
  Real mm = max({i*j for i in 1:3, j in 2:4});
  Real d[3] = diagonal({1,2,3})*b;
  Real s[3,2] = transpose(T);
  Real p = product({1,2,3,4});
  Real o[2,3] = matrix({1,2})*transpose(matrix({1,2,3}));
  Real cr[3] = cross({1,0,0}, {0,1,0});
  Real cc[5] = cat(1, {1,2}, {3,4,5});
  Real sm[3,3] = skew({1,2,3});
  Real e[2,2] = [1,2;3,4]^2;
equation
  A*x = b;
  // expect: c[1] @ 1 = 1
  // expect: c[2] @ 1 = 2
  // expect: tr @ 1 = 9
  // expect: m @ 1 = 4
  // expect: mm @ 1 = 12
  // expect: d[3] @ 1 = 9
  // expect: s[3,2] @ 1 = 1
  // expect: p @ 1 = 24
  // expect: o[2,3] @ 1 = 6
  // expect: cr[3] @ 1 = 1
  // expect: cc[5] @ 1 = 5
  // expect: sm[1,2] @ 1 = -3
  // expect: e[2,2] @ 1 = 22
end Mats;
