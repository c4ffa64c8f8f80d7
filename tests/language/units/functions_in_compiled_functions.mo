// A function with units, called by one without, called by one that is compiled.
function cs
  input Real u(unit="rad");
  output Real y = u;
end cs;
function rot
  input Real a;
  output Real y = cs(a);
end rot;
function f
  input Integer s;
  output Real y;
protected
  Real e[2] = {5, 6};
algorithm
  y := e[s];
  y := rot(y);
end f;
model Run
  parameter Integer s = 1;
  parameter Real y = f(s);
  Real z = f(s) + y*time;
  Real w = f(if time > 0.5 then 2 else 1);
  // expect: z @ 1 = 10
  // expect: w @ 1 = 6
end Run;
