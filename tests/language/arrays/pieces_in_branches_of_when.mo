// One branch of an `if` in a `when` sets a vector in two pieces, the other one as a whole.
model Run
  parameter Integer p[2] = {1, 2};
  parameter Integer q[2] = {3, 4};
  Boolean g[4](start = {true, true, false, false}, each fixed = true);
  Integer k[3](start = {1, 2, 3}, each fixed = true);
equation
  when sample(0.1, 0.1) then
    if noEvent(time < 0.15) then
      g[{p[1], q[1]}] = pre(g[{q[1], p[1]}]);
      g[{p[2], q[2]}] = {true, true};
      k[1:2] = pre(k[2:3]);
      k[3] = 7;
    else
      g = pre(g);
      k = 2*pre(k);
    end if;
  end when;
  // expect: g[1] @ 0.12 = 0
  // expect: g[2] @ 0.12 = 1
  // expect: g[3] @ 0.12 = 1
  // expect: g[4] @ 0.12 = 1
  // expect: g[1] @ 0.25 = 0
  // expect: k[1] @ 0.12 = 2
  // expect: k[2] @ 0.12 = 3
  // expect: k[3] @ 0.12 = 7
  // expect: k[1] @ 0.25 = 4
  // expect: k[3] @ 0.25 = 14
end Run;
