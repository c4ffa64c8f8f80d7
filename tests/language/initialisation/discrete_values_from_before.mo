// What an initial equation says of a value reaches the values from before that the equations take it from.
block Step
  parameter Boolean first = false;
  input Boolean enter;
  input Boolean leave;
  output Boolean active;
  Boolean next;
  Boolean old;
initial equation
  pre(next) = pre(active);
  pre(old) = pre(active);
equation
  active = pre(next);
  next = enter or active and not leave;
  when leave then
    old = active;
  end when;
end Step;
block First
  extends Step;
initial equation
  active = true;
end First;
block Other
  extends Step;
initial equation
  active = false;
end Other;
model Run
  First a(enter = false, leave = time > 0.5);
  Other b(enter = time > 0.5, leave = false);
  // expect: a.active @ 0.25 = 1
  // expect: a.old @ 0.25 = 1
  // expect: b.active @ 0.25 = 0
  // expect: b.active @ 1 = 1
  // expect: a.active @ 1 = 0
end Run;
