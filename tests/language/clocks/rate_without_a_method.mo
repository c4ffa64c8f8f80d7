model Run
  Real x(start = 1);
equation
  when Clock(0.1) then
    der(x) = -x; // error E0220: `x` has a clock and is differentiated, but its clock has no solver method
  end when;
end Run;
