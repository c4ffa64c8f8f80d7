// A Real that a `when` sets is a discrete-time variable wherever the `when` stands: `pre` of it has a meaning in initial equations.
model Run
  Real held, t;
initial equation
  pre(held) = 3;
  pre(t) = 0;
equation
  when sample(0.2, 0.2) then
    held = time;
    t = pre(t) + 1;
  end when;
  // expect: held @ 0.1 = 3
  // expect: held @ 0.5 = 0.4
  // expect: t @ 0.1 = 0
  // expect: t @ 0.5 = 2
end Run;
