// Values and sizes of declarations may read what is declared further down.
model Run
  function f
    input Real x;
    output Real y;
  protected
    Real a = x/b;
    Real v[n] = fill(a, n);
    Real b = 2*c;
    constant Integer n = 3;
    constant Real c = 0.5;
  algorithm
    y := sum(v);
  end f;
  function g
    input Real x;
    output Real y;
  protected
    Real a = x/b;
    Real b = 2*c;
    constant Real c = 0.5;
  algorithm
    y := a;
    while y < 10 loop
      y := y + 1;
    end while;
  end g;
  Real y = f(time);
  Real z = g(time);
  // expect: y @ 1 = 3
  // expect: z @ 0.5 = 10.5
end Run;
