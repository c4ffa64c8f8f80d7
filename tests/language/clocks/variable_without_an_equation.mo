model Run
  Real a;
  Real b; // error E0401: no equation says what the clocked variable `b` is at a tick
  Real c;
equation
  when Clock(0.1) then
    a = b + c;
    c = 2*a - a;
  end when;
end Run;
