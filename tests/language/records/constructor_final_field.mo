// What is final is not an argument (Modelica 3.6, section 12.6.1).
record R
  final parameter Real a = 2;
  Real b;
end R;
model Run
  R r = R(a = 3, b = 1); // error E0214: the field `a` of `R` is final and takes no value
end Run;
