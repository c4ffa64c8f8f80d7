// The wish for a state is heard whatever units make of the coefficients: T is a state, with its start, where u is 4184 times as large.
model Run
  parameter Real cv = 4184;
  Real T(start = 293.15, stateSelect = StateSelect.prefer);
  Real u;
  Real U;
  Real m;
  Real level(start = 0.8, stateSelect = StateSelect.prefer);
equation
  U = m*u;
  u = cv*(T - 273.15);
  m = 1000*level;
  der(m) = 20;
  der(U) = 20*cv*20;
  // note: what flows in is as warm as what is there
  // expect: T @ 0 = 293.15
  // expect: T @ 1 = 293.15
  // expect: level @ 1 = 0.82
  // note N0401 without line: the start is not fully determined: the start values of `T`, `level` are used as initial values
end Run;
