model Run
  Integer n(start = 0);
algorithm
  when Clock(0.1) then // error E0102: clocks in algorithm sections are outside the language profile
    n := pre(n) + 1;
  end when;
end Run;
