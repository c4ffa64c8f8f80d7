model Run
  Integer n(start = 0);
  Integer m;
equation
  when Clock(sin(10*time) > 0) then
    n = previous(n) + 1;
  end when;
  m = superSample(n, 2); // error E0220: this clock would have to tick between the ticks of a condition, whose times nobody knows before
end Run;
