record R
  Real x = 1;
  R inside = R(2); // error E0103: functions call each other deeper than 64 levels
end R;
function f
  input R r;
  output Real y = r.x;
end f;
model Run
  Real y = f(R());
end Run;
