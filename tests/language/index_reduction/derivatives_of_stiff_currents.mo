// Three coils in a star, stiff: the current of one is dependent, and its derivative is known to the tolerance over the step only, so that
// it must not decide how long a step is.
model Run
  parameter Real R = 100;
  constant Real w = 314.0;
  Real u[3] = {1e5*sin(w*time - k*2.0943951023931953) for k in 0:2};
  Real i[3];
  Real L[3] = {1e-7*(2 + sin(time + k)) for k in 1:3};
  Real v;
equation
  for k in 1:3 loop
    L[k]*der(i[k]) = u[k] - v - R*i[k];
  end for;
  sum(i) = 0;
  // note N0401 without line: the start is not fully determined: the start values of `i[1]`, `i[2]` are used as initial values
  // expect: i[1] @ 0.1 = 1000*sin(31.4) rel 2e-4
  // expect: i[1] @ 0.5 = 1000*sin(157) rel 2e-4
end Run;
