function f
  input Integer n;
  output Integer y = 0;
algorithm
  for i in 1:n:3 loop // error E0217: the step of this range is zero
    y := y + 1;
  end for;
end f;
model Run
  Real x = sum(i for i in 1:0:3); // error E0217: the step of this range is zero
  parameter Integer n = 0;
  Real y[3];
  Integer z = f(0);
equation
  for i in 1:n:3 loop // error E0217: the step of this range is zero
    y[i] = time;
  end for;
end Run;
