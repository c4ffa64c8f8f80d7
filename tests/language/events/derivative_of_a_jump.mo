// The derivative of what jumps is taken between the jumps; corners have one on either side.
model Run
  Real s "prescribed by a step";
  Real v;
  Real u "prescribed by a ramp";
  Real w;
  discrete Real k(start = 1, fixed = true);
  Real p "of a number that events change";
  Real q;
  discrete Real first(start = 0, fixed = true) "set at the start and never again";
  Real r;
  Real rate;
  Real drag "vanishes where its sign jumps";
  Real jerk;
equation
  s = if time < 0.5 then 0 else 0.01; // warning W0402: `s` jumps, and its derivative is asked for: it is taken as if there were no jump
  der(s) = v;
  u = if time < 0.5 then 0 else time - 0.5;
  der(u) = w;
  when time > 0.3 then
    k = 2;
  end when;
  p = time + k; // warning W0402: `p` jumps, and its derivative is asked for: it is taken as if there were no jump
  der(p) = q;
  when initial() then
    first = 1;
  end when;
  r = time - first;
  der(r) = rate;
  drag = (time - 0.5)*(if time > 0.5 then 1 else 0);
  der(drag) = jerk;
end Run;
