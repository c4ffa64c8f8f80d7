// Functions of the user's own with names of operators of clocks keep their meaning.
function previous
  input Real x;
  output Real y;
algorithm
  y := x - 1;
end previous;
function interval
  input Real a;
  input Real b;
  output Real w;
algorithm
  w := b - a;
end interval;
model Run
  Real x = previous(3);
  Real w = interval(1, 4);
  // expect: x @ 1 = 2
  // expect: w @ 1 = 3
end Run;
