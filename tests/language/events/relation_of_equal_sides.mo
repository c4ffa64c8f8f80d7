// A switch that has opened conducts a little, so that its current is a conductance times its voltage, and a relation asks whether the current
// is no more than that: both sides are equal but for rounding, and what has been quenched stays so whatever the relation says.
model Run
  parameter Real G = 1e-5;
  Real i(start = 1, fixed = true);
  Real v;
  Real w(start = 0, fixed = true);
  Boolean off(start = false, fixed = true);
  Boolean quenched(start = false, fixed = true);
equation
  der(i) = if off then -v*1e-5 + 0.3*cos(10*time) else -i;
  off = time > 0.2;
  quenched = off and (abs(i) <= abs(v)*G or pre(quenched));
  if quenched or not off then
    i = G*v;
  else
    v = i/G;
  end if;
  der(w) = if quenched then 1 else 0;
  // expect: w @ 1 = 0.8
  // expect: i @ 0.1 = exp(-0.1)
end Run;
