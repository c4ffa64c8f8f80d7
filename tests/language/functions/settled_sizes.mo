// Variables of a compiled function that are numbers known before the run, and that no statement changes, may size arrays.
package P
  function ramp
    input Real scale;
    input Integer n = 8;
    output Real y[n];
  protected
    Real a = ceil(n/4);
    Integer b = integer(a) + 1;
    Real d = 1/a;
    Real u[:] = {scale*k for k in 1:b};
    Real w[:] = d:d:1;
    Integer changes = 1;
  algorithm
    y := zeros(n);
    while changes < b loop
      changes := changes + 1;
    end while;
    y[1:b] := u;
    y[n] := changes;
    y[b + 1:b + size(w, 1)] := w;
    annotation (Inline = false);
  end ramp;
  model Run
    Real y[8] = ramp(1 + time);
    // expect: y[3] @ 1 = 6
    // expect: y[4] @ 1 = 0.5
    // expect: y[5] @ 1 = 1
    // expect: y[8] @ 1 = 3
  end Run;
end P;
