model Run
  Integer n(start = 0, fixed = true);
  Integer m(start = 0);
equation
  when Clock(0.3) then
    m = previous(m) + n;
  end when;
  when sample(0, 0.1) then
    n = pre(n) + 1; // error E0220: `n` changes at events, but it stands in an equation of a clock
  end when;
end Run;
