// The derivative of what jumps is taken between the jumps; corners have one on either side.
model Run
  Real s "prescribed by a step";
  Real v;
  Real u "prescribed by a ramp";
  Real w;
  discrete Real k(start = 1, fixed = true);
  Real p "of a number that events change";
  Real q;
equation
  s = if time < 0.5 then 0 else 0.01; // warning W0402: `s` jumps, and its derivative is asked for: it is taken as if there were no jump
  der(s) = v;
  u = if time < 0.5 then 0 else time - 0.5;
  der(u) = w;
  when time > 0.3 then
    k = 2;
  end when;
  p = k*time; // warning W0402: `p` jumps, and its derivative is asked for: it is taken as if there were no jump
  der(p) = q;
end Run;
