// Once quenched the arc stays so, whatever its current is compared with: the relation, whose sides an equation makes equal, switches with each
// rounding and nothing depends on it.
// stop: 2
model Run
  parameter Real Goff = 1e-5;
  Real i;
  Real v;
  Real x(start = 0, fixed = true);
  Boolean off = time > 0.5;
  Boolean quenched(start = false, fixed = true); // expect: quenched @ 2 = 1
equation
  quenched = off and (abs(i) <= abs(v)*Goff or pre(quenched));
  if off then
    i = Goff*v;
  else
    v = 1e-5*i;
  end if;
  i + 3e-3*(v - 10*sin(50*time)) = 0;
  der(x) = v; // expect: x @ 2 = 0.02575 rel 0.01
end Run;
