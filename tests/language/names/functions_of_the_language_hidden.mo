// Names are looked up from the inside out, and functions of the language stand outermost (Modelica 3.6, section 5.3.1).
package P
  constant Real k = 100;
  function max "of magnitudes"
    input Real a;
    input Real b;
    output Real y;
  algorithm
    y := if a*a > b*b then a else b;
  end max;
  function sum
    input Real v[:];
    output Real y = v[1] - v[2];
  end sum;
  function mod
    input Integer a;
    input Integer b;
    output Integer y = a + b;
  end mod;
  function fill
    input Real x;
    input Integer n;
    output Real y[2] = {x, n};
  end fill;
  function uses "also before the run"
    input Integer n;
    output Integer y = mod(n, 3);
  end uses;
  function compiled
    input Real x;
    output Real y;
  protected
    Real w = x;
  algorithm
    while w < 5 loop
      w := w + 1;
    end while;
    y := max(-w, 1) + sin(w);
  end compiled;
  function sin
    input Real x;
    output Real y = k*x;
  end sin;
  model Inside
    Real a = max(-3, 2);
    Real b = sum({5, 2});
    Real c = fill(time, 7)*{1, 1};
    Real d = sin(time);
    Real e[uses(1)] = {1, 2, 3, 4}*time;
    Real f = compiled(time);
    parameter Integer n = mod(4, 5);
    Real g[n] = {i*time for i in 1:n};
    Real h = cos(0*time) + max(abs(-4), 2);
  end Inside;
end P;
package Q
  import P.max;
  import s = P.sum;
  model Imported
    Real a = max(-3, 2);
    Real b = sum({5, 2});
    Real c = s({5, 2});
  end Imported;
end Q;
package All
  import P.*;
  model Imported
    Real a = max(-3, 2);
  end Imported;
end All;
model Local
  function min
    input Real a;
    input Real b;
    output Real y = a*b;
  end min;
  Real a = min(5, 2);
  Real b = max(5, 2);
  Real c = .max(5, 2);
end Local;
function max
  input Real a;
  input Real b;
  output Real y = a - b;
end max;
model Run
  P.Inside i;
  Q.Imported q;
  All.Imported all;
  Local l;
  // expect: i.a @ 1 = -3
  // expect: i.b @ 1 = 3
  // expect: i.c @ 1 = 8
  // expect: i.d @ 1 = 100
  // expect: i.e[4] @ 1 = 4
  // expect: i.f @ 1 = -5 + 500
  // expect: i.g[9] @ 1 = 9
  // expect: i.h @ 1 = 5
  // expect: q.a @ 1 = -3
  // expect: q.b @ 1 = 7
  // expect: q.c @ 1 = 3
  // expect: all.a @ 1 = -3
  // expect: l.a @ 1 = 10
  // expect: l.b @ 1 = 3
  // expect: l.c @ 1 = 3
end Run;
