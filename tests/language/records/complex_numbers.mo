model E02 "record functions, arrays of records, matrix eq"
  record C
    Real re; Real im;
  end C;
  function mul
    input C a; input C b; output C c;
  algorithm
    c.re := a.re*b.re - a.im*b.im;
    c.im := a.re*b.im + a.im*b.re;
  end mul;
  function add
    input C a; input C b; output C c = C(a.re+b.re, a.im+b.im);
  algorithm
  end add;
  C z[3];
  C s;
equation
  z[1] = C(cos(time), sin(time));
  for i in 2:3 loop
    z[i] = mul(z[i-1], z[1]);
  end for;
  s = add(z[1], z[3]);
  // expect: z[3].re @ 1 = cos(3)
  // expect: s.im @ 1 = sin(1)+sin(3)
end E02;
