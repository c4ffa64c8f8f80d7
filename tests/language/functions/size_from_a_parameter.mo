// A parameter that is given to a function and decides sizes in it decides on structure.
// set: n = 4
model Run
  function total
    input Real t;
    input Integer k;
    output Real y;
  protected
    Real a[k];
  algorithm
    for i in 1:k loop
      a[i] := i*t;
    end for;
    y := sum(a);
  end total;
  function steps
    input Real t;
    input Integer k;
    output Real y[k];
  algorithm
    for i in 1:k loop
      y[i] := i*t;
    end for;
  end steps;
  parameter Integer k = 3;
  parameter Integer n = 2;
  Real y = total(time, k);
  Real z = total(time, n + 1);
  Real w[k] = steps(time, k);
  Real v[2];
equation
  for i in 1:2 loop
    v[i] = total(time, i);
  end for;
  // expect: y @ 1 = 6
  // expect: z @ 1 = 15
  // expect: w[3] @ 1 = 3
  // expect: v[2] @ 1 = 3
end Run;
