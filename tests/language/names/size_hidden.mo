model Run
  function size
    input Real x[:];
    input Integer k;
    output Real y = k*x[1];
  end size;
  Real y = size({time, 2}, 1); // error E0102: a declaration that hides the function `size` is outside the language profile
end Run;
