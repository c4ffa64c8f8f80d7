record R
  Real a = b; // error E0211: the value of the field `a` depends on itself
  Real b = a;
end R;
function f
  input R r;
  output Real y = r.a;
end f;
model Run
  Real y = f(R());
end Run;
