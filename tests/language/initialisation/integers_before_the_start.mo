// Integers before the first event, from a parameter that is itself found at the start.
model Run
  parameter Integer given = 3;
  parameter Integer seed(fixed = false);
  Integer n[2];
  Boolean on;
  discrete Real r;
initial equation
  seed = if given > 2 then 614657 else 1;
  pre(n) = {seed, 7};
  pre(on) = seed > 10;
  r = pre(n[1])/2;
equation
  when sample(0.5, 1) then
    n = {pre(n[1]) + 1, pre(n[2]) - 1};
    on = not pre(on);
    r = pre(r) + 1;
  end when;
  // expect: n[1] @ 0.25 = 614657
  // expect: n[1] @ 1 = 614658
  // expect: n[2] @ 1 = 6
  // expect: on @ 0.25 = 1
  // expect: on @ 1 = 0
  // expect: r @ 0.25 = 307328.5
  // expect: r @ 1 = 307329.5
end Run;
