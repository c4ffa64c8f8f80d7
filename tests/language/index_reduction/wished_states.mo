// `prefer` and `always` make states of variables that nobody differentiates (Modelica 3.6, section 4.8.8.1), also through a
// parameter, in arrays, in records and by modification: what is reset leaves them as they are.
record Pair
  Real p;
  Real q(stateSelect = StateSelect.prefer);
end Pair;
model Two
  parameter StateSelect wish = StateSelect.default;
  Real a(start = 1, fixed = true, stateSelect = StateSelect.always);
  Real b;
  Real d(start = 0.1, fixed = true, stateSelect = wish);
equation
  d = a - b;
  der(a) = 0;
  der(b) = 0;
  when time > 0.5 then
    reinit(a, 0);
  end when;
end Two;
model Pairs
  Real a(start = 1, fixed = true, stateSelect = StateSelect.always);
  Real b;
  Pair r(q(start = 0.1, fixed = true));
equation
  r.p = a + b;
  r.q = a - b;
  der(a) = 0;
  der(b) = 0;
  when time > 0.5 then
    reinit(a, 0);
  end when;
end Pairs;
model Lists
  Real a(start = 1, fixed = true, stateSelect = StateSelect.always);
  Real b;
  Real d[2](start = {0.1, 5}, fixed = {true, false}, stateSelect = {StateSelect.prefer, StateSelect.default});
equation
  d = {a - b, a + b};
  der(a) = 0;
  der(b) = 0;
  when time > 0.5 then
    reinit(a, 0);
  end when;
end Lists;
model Run
  Two t(wish = StateSelect.prefer);
  Two plain(b(stateSelect = StateSelect.prefer));
  Pairs p;
  Lists l;
  // expect: t.d @ 1 = 0.1
  // expect: t.b @ 1 = -0.1
  // expect: t.b @ 0.25 = 0.9
  // expect: plain.b @ 1 = 0.9
  // expect: plain.d @ 1 = -0.9
  // expect: p.r.q @ 1 = 0.1
  // expect: p.r.p @ 1 = -0.1
  // expect: l.d[1] @ 1 = 0.1
  // expect: l.d[2] @ 1 = -0.1
end Run;
