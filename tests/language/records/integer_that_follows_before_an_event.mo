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
  State s = state_of(4*time);
  Integer before = pre(s.n); // error E0218: `s.n` follows from continuous values and changes at any time: it cannot decide an event
end Run;
