model Run
  Integer n(start = 0);
  Integer m;
equation
  when Clock(0.1) then
    n = previous(n) + 1;
  end when;
  m = backSample(n, 1); // error E0220: the first tick of this clock would come before the start
end Run;
