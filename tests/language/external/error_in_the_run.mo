function fail
  input String text;
  external "C" ModelicaError(text);
end fail;
function root
  input Real x;
  output Real y;
algorithm
  if x < 0 then
    fail("the root of a negative number");
  end if;
  y := sqrt(x);
end root;
model Run
  Real x = root(1 - 2*time);
  // run error: the root of a negative number
end Run;
