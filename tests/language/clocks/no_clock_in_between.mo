// `noClock` takes the value that is there, whatever its clock.
model Run
  Integer a(start = 0);
  Integer b(start = 0);
equation
  when Clock(3, 10) then
    a = previous(a) + 1;
  end when;
  when Clock(0.25) then
    b = noClock(a);
  end when;
  // note: a is 1 from 0, 2 from 0.3, 3 from 0.6 on; b takes it at 0, 0.25, 0.5, 0.75
  // expect: b @ 0.45 = 1
  // expect: b @ 0.7 = 2
  // expect: b @ 0.8 = 3
end Run;
