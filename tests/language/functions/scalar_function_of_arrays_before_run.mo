// A function of scalars that is called with arrays before the run: once for each element (12.4.6), with several outputs, too.
package P
  function kelvin
    input Real celsius;
    output Real t = celsius + 273.15;
  algorithm
    t := celsius + 273.15;
  end kelvin;
  function split
    input Real a;
    input Real b = 1;
    output Integer whole;
    output Real rest;
  algorithm
    whole := integer(a/b);
    rest := a - whole*b;
  end split;
  function total
    input Real a[:];
    output Integer n;
  protected
    Integer parts[size(a, 1)];
    Real rests[size(a, 1)];
  algorithm
    (parts, rests) := split(a, 2);
    n := sum(parts);
  end total;
  model Run
    constant Real t[:] = kelvin({0, 10, 20});
    constant Real u[:, :] = kelvin({{0, 10}, {20, 30}, {40, 50}});
    Real x[total({5.5, 3, 2})] = fill(time, total({5.5, 3, 2}));
    Real y = t[size(t, 1)] + u[size(u, 1), 2];
    // 2 + 1 + 1
    // expect: x[4] @ 1 = 1
    // expect: y @ 1 = 293.15 + 323.15
  end Run;
end P;
