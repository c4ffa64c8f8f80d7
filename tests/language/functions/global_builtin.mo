// A leading dot means what is predefined, inside a package that declares the same names (5.3.1).
package P
  function max
    input Real a;
    input Real b;
    output Real c = 10*a + b;
  end max;
  function sin
    input Real u;
    output Real y;
  algorithm
    y := .sin(u);
  end sin;
  model Run
    constant Real n = .max(1, 2);
    parameter Integer k = integer(.max(2, 3));
    Real v[k] = fill(.max(time, 0.5), k);
    Real x = max(1, 2);
    Real y = sin(time);
    Real w = n;
    // expect: v[3] @ 1 = 1
    // expect: x @ 1 = 12
    // expect: y @ 1 = sin(1)
    // expect: w @ 1 = 2
  end Run;
end P;
