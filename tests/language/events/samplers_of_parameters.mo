// Intervals that are parameters, in a loop and in components, with first instants before the start.
block Counter
  parameter Real first = 0;
  parameter Real period = 1;
  Integer n(start = 0, fixed = true);
equation
  when sample(first, period) then
    n = pre(n) + 1;
  end when;
end Counter;
model M
  parameter Real p = 1;
  Counter counters[3](each first = -2, period = {p, 2*p, 3*p});
  Integer v[3](each start = 0, each fixed = true);
equation
  for i in 1:3 loop
    when sample(-2 + i*p, 7*p) then
      v[i] = pre(v[i]) + 1;
    end when;
  end for;
  // model: M
  // set: p = 0.1
  // stop: 8
  // note: -2 + 0.1 k, -2 + 0.2 k and -2 + 0.3 k from 0 to 8
  // expect: counters[1].n @ 8 = 81
  // expect: counters[2].n @ 8 = 41
  // expect: counters[3].n @ 8 = 27
  // note: -1.9 + 0.7 k, -1.8 + 0.7 k, -1.7 + 0.7 k
  // expect: v[1] @ 8 = 12
  // expect: v[2] @ 8 = 12
  // expect: v[3] @ 8 = 11
end M;
