// Arrays of records without elements: nobody asks for their values.
package P
  record R
    Real x;
    Real y[2];
  end R;
  function make
    input Integer n;
    output R r[n];
  algorithm
    for i in 1:n loop
      r[i] := R(i, {i, 2*i});
    end for;
  end make;
  function total
    input R r[:];
    output Real y;
  algorithm
    y := sum(r.x) + size(r, 1);
  end total;
  model Part
    parameter Integer n = 0;
    parameter R r[n];
    parameter Real xs[:] = r.x;
    Real z = size(xs, 1) + sum(xs);
  end Part;
  model Run
    Part part;
    parameter Integer n = 0;
    parameter R none[:] = make(n);
    parameter R some[:] = make(2);
    parameter R filled[:] = fill(R(1, {1, 2}), 0);
    Real a = size(none, 1);
    Real b = total(none);
    Real c = total(some);
    Real d = total(make(n))*time;
    Real e = size(filled, 1);
    // expect: part.z @ 0 = 0
    // expect: a @ 0 = 0
    // expect: b @ 0 = 0
    // expect: c @ 0 = 5
    // expect: d @ 1 = 0
    // expect: e @ 0 = 0
  end Run;
end P;
