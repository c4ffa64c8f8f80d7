// The position is prescribed, and `q` is set twice: nothing is said against the prescribed motion.
model Run
  Real x;
  Real v;
  Real p(start = 0, fixed = true);
  Real q;
equation
  x = sin(time); // error E0401: 5 equations for 4 unknowns
  v = der(x);
  der(p) = -p + v;
  q = p;
  q = 2*p + 1;
end Run;
