// The assertion of a function without outputs ends the run.
model Run
  function below
    input Real u;
    input Real limit;
  algorithm
    assert(u < limit, "too large");
  end below;
  Real x = time;
equation
  below(x, 0.5);
  // run error: too large
end Run;
