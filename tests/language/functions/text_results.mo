// Functions that take and give Strings, called in equations.
model Run
  function name
    input Integer k;
    output String s;
  algorithm
    s := if k == 1 then "one" else "other";
  end name;
  function rank
    input String s;
    output Real y;
  algorithm
    y := if s == "one" then 1 else 2;
  end rank;
  Real x, y;
equation
  x = rank(name(1))*time;
  y = if name(2) == "other" then 3 else 4;
  // expect: x @ 1 = 1
  // expect: y @ 1 = 3
end Run;
