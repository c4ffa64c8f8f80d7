// Equations of a `when` have no order, so one branch sets a variable once; where an `if` decides between two, they are one.
model Run
  parameter Boolean late = true;
  Integer x(start = 0, fixed = true);
  Integer y(start = 0, fixed = true);
equation
  when time > 0.5 then
    x = 1;
    // error E0401: `x` is set twice by one branch of a `when`
    x = 2;
    if late then
      y = 1;
    end if;
    if not late then
      y = 2;
    end if;
  end when;
end Run;
