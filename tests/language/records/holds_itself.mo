record R // error E0103: records are nested deeper than 50 levels: does `R` hold itself?
  Real x = 1;
  R inside;
end R;
function f
  input R r;
  output Real y = r.x;
end f;
model Run
  Real y = f(R());
end Run;
