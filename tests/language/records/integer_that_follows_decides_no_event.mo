// An Integer that follows from continuous values changes between the instants that events are looked for at.
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
  Integer count(start = 0, fixed = true);
equation
  when s.n == 2 then // error E0218: `s.n` follows from continuous values and changes at any time: it cannot decide an event
    count = pre(count) + 1;
  end when;
end Run;
