// A condition reads what was assigned above with its new value, and what is assigned below with the value before the event.
model Run
  Integer day(start = 1, fixed = true), first(start = 1, fixed = true), length(start = 3, fixed = true);
  Boolean on(start = false, fixed = true);
  Integer ons(start = 0, fixed = true), offs(start = 0, fixed = true);
  Real u = sin(6*time);
algorithm
  when sample(0.1, 0.1) then
    day := mod(pre(day), pre(length)) + 1;
  end when;
  when first + day == length + 1 then
    first := 1;
    length := 4;
  end when;
algorithm
  when u > 0.5 then
    on := true;
    ons := ons + 1;
  elsewhen u < 0.5 and on then
    on := false;
    offs := offs + 1;
  end when;
  // day: 2, 3 at 0.1, 0.2, which makes the month one of four days; 4, 1 at 0.3, 0.4
  // expect: day @ 0.15 = 2
  // expect: length @ 0.15 = 3
  // expect: day @ 0.25 = 3
  // expect: length @ 0.25 = 4
  // expect: day @ 0.35 = 4
  // expect: day @ 0.45 = 1
  // on from asin(0.5)/6 = 0.0873 to 0.4363
  // expect: on @ 0.05 = 0
  // expect: on @ 0.2 = 1
  // expect: on @ 0.5 = 0
  // expect: ons @ 1 = 1
  // expect: offs @ 1 = 1
end Run;
