// `.*` of two vectors goes element by element, whatever `*` of two vectors means (Modelica 3.6, section 14.5).
operator record C
  Real re;
  Real im;
  encapsulated operator '*'
    function multiply
      input C a;
      input C b;
      output C c = C(a.re*b.re - a.im*b.im, a.re*b.im + a.im*b.re);
    end multiply;
    function scalarProduct
      input C a[:];
      input C b[size(a, 1)];
      output C c = C(0, 0);
    algorithm
      for k in 1:size(a, 1) loop
        c := C(c.re + a[k].re*b[k].re - a[k].im*b[k].im, c.im + a[k].re*b[k].im + a[k].im*b[k].re);
      end for;
    end scalarProduct;
  end '*';
end C;
model Run
  C v[2] = {C(time, 1), C(2, 0)};
  C w[2] = {C(0, 1), C(3, time)};
  C product[2] = v .* w;
  C total = v*w;
  // expect: product[1].re @ 2 = -1
  // expect: product[1].im @ 2 = 2
  // expect: product[2].re @ 2 = 6
  // expect: product[2].im @ 2 = 4
  // expect: total.re @ 2 = 5
  // stop: 2
end Run;
