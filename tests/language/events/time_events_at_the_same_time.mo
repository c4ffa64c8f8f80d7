// Running sums of a user, `time >` and `time >=`, and a sampler, all at about the same instants.
model M
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
  Integer k(start = 0, fixed = true);
  discrete Real next(start = 0.1, fixed = true);
  discrete Real other(start = 0.1, fixed = true);
equation
  when time > pre(next) then
    next = pre(next) + 0.1;
    n = pre(n) + 1;
  end when;
  when time >= pre(other) then
    other = pre(other) + 0.1;
    m = pre(m) + 1;
  end when;
  when sample(0.1, 0.1) then
    k = pre(k) + 1;
  end when;
  // stop: 100.05
  // expect: n @ 100.05 = 1000
  // expect: m @ 100.05 = 1000
  // expect: k @ 100.05 = 1000
end M;
