// The instants are start + k*interval (Modelica 3.6, section 3.7.5): none is lost, and those that are equal are one event.
model M
  Integer a(start = 0, fixed = true);
  Integer b(start = 0, fixed = true);
  Integer c(start = 0, fixed = true);
  Integer both(start = 0, fixed = true);
  Integer all(start = 0, fixed = true);
equation
  when sample(0, 0.1) then
    a = pre(a) + 1;
  end when;
  when sample(0, 0.2) then
    b = pre(b) + 1;
  end when;
  when sample(0, 1/3) then
    c = pre(c) + 1;
  end when;
  when sample(0, 0.1) and sample(0, 0.2) then
    both = pre(both) + 1;
  end when;
  when sample(0, 0.3) and sample(0, 0.1) and sample(0, 1/3) then
    all = pre(all) + 1;
  end when;
  // stop: 100
  // expect: a @ 99.85 = 999
  // expect: b @ 99.85 = 500
  // expect: c @ 99.85 = 300
  // expect: both @ 99.85 = 500
  // note: 0, 1, 2 and so on are multiples of 0.1 and of 1/3, every third of them is one of 0.3
  // expect: all @ 99.85 = 34
  // note: the end of the run coincides with an instant
  // expect: a @ 100 = 1001
  // expect: b @ 100 = 501
end M;
