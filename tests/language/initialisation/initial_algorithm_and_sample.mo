// An initial algorithm sets a parameter, from which a sampler begins, and a Boolean, which an initial equation hands on.
model Run
  Boolean y, u;
  parameter Real t0(fixed = false);
initial algorithm
  t0 := 0.25;
  u := true;
initial equation
  y = u;
equation
  when sample(t0, 2) then
    u = false;
  end when;
  when not u then
    y = u;
  end when;
  // expect: y @ 0 = 1
  // expect: u @ 0.2 = 1
  // expect: u @ 0.3 = 0
  // expect: y @ 0.3 = 0
end Run;
