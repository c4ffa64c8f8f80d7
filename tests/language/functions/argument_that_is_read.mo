model Run
  function inside
    input Real given;
    input Real x;
    output Real y;
  algorithm
    y := 2*x + given;
  end inside;
  function around
    input Real x;
    output Real y;
  algorithm
    if x > 0.5 then
      y := inside(y, x); // error E0201: `y` has no value here: nothing has set it
    else
      y := 1;
    end if;
  end around;
  Real y = around(time);
end Run;
