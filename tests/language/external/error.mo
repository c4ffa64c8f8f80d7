// `ModelicaError` ends the run with a text (12.9.6.1), which may show values of the run.
function fail
  input String text;
  external "C" ModelicaError(text);
end fail;
function root
  input Real x;
  output Real y;
algorithm
  if x < 0 then
    fail("no root of " + String(x));
  end if;
  y := sqrt(x);
end root;
model Run
  Real x = root(4*time);
  // expect: x @ 1 = 2
end Run;
