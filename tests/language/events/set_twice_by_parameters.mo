// Which of two equations of a `when` counts may be decided by parameters; where both do, the run says so.
// set: early = true
// run error: `y` is set twice by one branch of a `when` with these parameters
model Run
  parameter Boolean late = true;
  parameter Boolean early = false;
  Integer y(start = 0, fixed = true);
equation
  when time > 0.5 then
    if late then
      y = 1;
    end if;
    if early then
      y = 2;
    end if;
  end when;
end Run;
