model Run
  Real a;
  Real b;
equation
  when Clock(0.1) then
    a = b + 1; // error E0405: the discrete variables `a`, `b` depend on each other in a cycle
    b = sin(a);
  end when;
end Run;
