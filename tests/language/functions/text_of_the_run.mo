// A String that is only shown may be made of values of the run.
function fail
  input String text;
algorithm
  assert(false, text);
end fail;
function root
  input Real x;
  output Real y;
algorithm
  if x < 0 then
    fail("no root of " + String(x));
  end if;
  y := x;
end root;
model Run
  Real x = root(1 - 2*time);
  // run error: no root of String(x)
end Run;
