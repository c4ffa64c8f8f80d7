model Run
  Integer n(start = 0);
  Integer m(start = 0);
equation
  when Clock(0.1) then
    n = previous(n) + 1;
    m = hold(n) + previous(m); // error E0220: `hold` gives a value that holds at all times, but it stands in an equation of a clock
  end when;
end Run;
