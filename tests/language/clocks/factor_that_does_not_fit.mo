model Run
  Real a;
  Real b;
equation
  a = sample(time, Clock(2, 10));
  when Clock(3, 10) then
    b = subSample(a); // error E0220: no factor leads from a clock that ticks every 0.2 s to one that ticks every 0.3 s
  end when;
end Run;
