model D10
  parameter Integer n = 3;
  Real x[n];
  Real y;
equation
  for i in 1:n loop
    // error E0207: subscript 4 of `x` is outside 1..3
    x[i+1] = i;
  end for;
  // error E0207: subscript 0 of `x` is outside 1..3
  y = x[0];
end D10;
