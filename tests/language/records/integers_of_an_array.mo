// Elements of an array of records follow by equations of their own.
model Run
  record State
    Integer n;
    Real T;
  end State;
  function state_of
    input Real h;
    output State s;
  algorithm
    s := State(if h > 2 then 2 else 1, h/2);
  end state_of;
  State s[2];
  Real y = 10*s[1].n + s[2].n;
equation
  s[1] = state_of(4*time);
  s[2] = state_of(2.5*time);
  // expect: y @ 0.4 = 11
  // expect: y @ 0.6 = 21
  // expect: y @ 1 = 22
end Run;
