model M
  parameter Real f = 1;
  parameter Real p = f - 1;
  Integer n(start = 0, fixed = true);
equation
  when sample(0, p) then n = pre(n) + 1; end when;
  // set: f = 0.5
  // run error: the interval of `sample(0, p)` is -0.5, and must be a positive number
end M;
