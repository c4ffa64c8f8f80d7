// Where the branch is not taken the interval need not be positive.
model M
  parameter Real f = 0;
  parameter Real g = 10;
  Boolean b = if f > 0 then sample(0, 1/f) else false;
  Boolean d = g > 0 and sample(0, 1/g);
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
equation
  when b then n = pre(n) + 1; end when;
  when d then m = pre(m) + 1; end when;
  // expect: n @ 1 = 0
  // expect: m @ 1 = 11
end M;
