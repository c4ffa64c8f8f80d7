partial function F
  input Real u;
  output Real y;
end F;
function apply
  input F f;
  input Real u;
  // error E0214: the input `k` has no value
  output Real y = f(u);
end apply;
function g
  input Real u;
  input Real k;
  output Real y = k*u;
end g;
record R
  Real x;
end R;
model Run
  Real a = apply(function g(m = 3), time); // error E0214: there is no input `m`
  Real b = apply(g, time);
  Real c = apply(2, time); // error E0204: the input `f` is a function, but this is Integer
  Real d = g(g, time); // error E0204: the input `u` is Real, but this is a function
  Real e = apply(function R(x = 1), time); // error E0214: `R` is not a function
end Run;
