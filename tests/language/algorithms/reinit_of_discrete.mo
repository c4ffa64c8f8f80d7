model Run
  Real x(start = 0, fixed = true);
  discrete Real d(start = 0, fixed = true);
equation
  der(x) = 1;
algorithm
  when x > 0.5 then
    reinit(d, 1); // error E0216: `reinit` needs a state, but `d` has no derivative
    d := 2;
  end when;
end Run;
