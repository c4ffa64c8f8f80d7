// At 1 `>=` and `<` have changed, `>` and `<=` have not: they change right after (Modelica 3.6, section 3.5).
model M
  Boolean a = time > 1;
  Boolean b = time >= 1;
  Boolean c = time < 1;
  Boolean d = time <= 1;
  Boolean e = not (1 < time);
  Boolean f = 2 - 2*time > 0;
  Boolean g = 2 - 2*time >= 0;
  Boolean sampled[7](each start = false, each fixed = true);
  Integer rises(start = 0, fixed = true);
  Integer falls(start = 0, fixed = true);
  Integer whole = integer(1 - time);
equation
  when sample(0.25, 0.75) then
    sampled = {a, b, c, d, e, f, g};
  end when;
  when {a, b} then
    rises = pre(rises) + 1;
  end when;
  when {not c, not d} then
    falls = pre(falls) + 1;
  end when;
  // stop: 1.5
  // expect: sampled[1] @ 1.5 = 0
  // expect: sampled[2] @ 1.5 = 1
  // expect: sampled[3] @ 1.5 = 0
  // expect: sampled[4] @ 1.5 = 1
  // expect: sampled[5] @ 1.5 = 1
  // expect: sampled[6] @ 1.5 = 0
  // expect: sampled[7] @ 1.5 = 1
  // expect: a @ 1.5 = 1
  // expect: d @ 1.5 = 0
  // expect: rises @ 1.5 = 2
  // expect: falls @ 1.5 = 2
  // note: integer(1 - time) is 1 at 0, 0 until 1, -1 right after
  // expect: whole @ 0.6 = 0
  // expect: whole @ 1.2 = -1
end M;
