// What a function does not read may be a variable that nothing has set yet.
model Run
  function inside
    input Real given;
    input Real x;
    output Real y;
  algorithm
    y := 2*x;
  end inside;
  function around
    input Real x;
    output Real y;
  algorithm
    if x > 0.5 then
      y := inside(y, x);
    else
      y := 1;
    end if;
  end around;
  Real y = around(time);
  // expect: y @ 0.25 = 1
  // expect: y @ 1 = 2
end Run;
