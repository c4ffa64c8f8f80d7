model Run
  constant Real list[20] = {0.5*k for k in 1:20};
  function at
    input Real t;
    output Real y;
  protected
    Integer k;
  algorithm
    k := 1;
    while k < t loop
      k := k + 1;
    end while;
    y := list[k];
  end at;
  Real x = at(25*time);
  // run error: a subscript is outside of an array of 20 elements
end Run;
