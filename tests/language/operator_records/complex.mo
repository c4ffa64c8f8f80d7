// Operators of a record: numbers beside it, vectors of it, signs, powers of its own (chapter 14).
operator record C
  Real re;
  Real im;
  encapsulated operator 'constructor'
    function fromReal
      import C;
      input Real re;
      input Real im = 0;
      output C result(re = re, im = im);
    algorithm
    end fromReal;
  end 'constructor';
  encapsulated operator '-'
    function negate
      import C;
      input C a;
      output C b = C(-a.re, -a.im);
    end negate;
    function subtract
      import C;
      input C a;
      input C b;
      output C c = C(a.re - b.re, a.im - b.im);
    end subtract;
  end '-';
  encapsulated operator '*'
    function multiply
      import C;
      input C a;
      input C b;
      output C c = C(a.re*b.re - a.im*b.im, a.re*b.im + a.im*b.re);
    end multiply;
  end '*';
  encapsulated operator function '+'
    import C;
    input C a;
    input C b;
    output C c = C(a.re + b.re, a.im + b.im);
  end '+';
end C;
model Run
  constant C j = C(0, 1);
  parameter C z(re = 3, im = 4);
  C a = j*z;
  C b = 2*z + 1;
  C c;
  C v[2] = {z, j};
  C w[2] = v + v;
  C u[2] = j*v;
  C unknown;
equation
  c = -a - b*C(time);
  unknown*1 + z = C(time, 0);
  // expect: a.re @ 1 = -4
  // expect: a.im @ 1 = 3
  // expect: b.re @ 1 = 7
  // expect: b.im @ 1 = 8
  // expect: c.re @ 1 = -3
  // expect: c.im @ 1 = -11
  // expect: w[1].im @ 1 = 8
  // expect: w[2].im @ 1 = 2
  // expect: u[2].re @ 1 = -1
  // expect: unknown.re @ 1 = -2
  // expect: unknown.im @ 1 = -4
end Run;
