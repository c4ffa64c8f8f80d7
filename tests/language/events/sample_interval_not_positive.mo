model M
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
  constant Real c = 0.5;
equation
  // error E0214: the interval of `sample(0, 0)` is 0, and must be a positive number
  when sample(0, 0) then n = pre(n) + 1; end when;
  // error E0214: the interval of `sample(0, c - 1)` is -0.5, and must be a positive number
  when sample(0, c - 1) then m = pre(m) + 1; end when;
end M;
