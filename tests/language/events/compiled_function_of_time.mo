// Nothing is known of a compiled function between two points.
function pulses
  input Real t;
  output Real y;
protected
  Real s;
algorithm
  s := t;
  while s > 0.1 loop
    s := s - 0.1;
  end while;
  y := if s < 1e-4 then 1 else 0;
end pulses;
model Run
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
  Real y = pulses(time);
  Real x(start = 0, fixed = true);
equation
  der(x) = 1;
  when y > 0.5 then // warning W0401: this condition depends on time through a compiled function: a change between two steps may be missed
    n = pre(n) + 1;
  end when;
  // A condition of a state is looked at like any other.
  when pulses(x) > 0.5 then
    m = pre(m) + 1;
  end when;
end Run;
