model M
  Integer n(start = 0, fixed = true);
  Real x(start = 1, fixed = true);
equation
  der(x) = -x;
  // error E0206: the interval of `sample` must be known before the run
  when sample(0, x) then n = pre(n) + 1; end when;
end M;
