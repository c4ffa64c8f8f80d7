// So it is in an `if` within another one, and beside an `elsewhen`.
model Run
  Integer g[3](each start = 0, each fixed = true);
  Integer h(start = 0, fixed = true);
equation
  when sample(0.1, 0.2) then
    if time < 0.35 then
      g[{1, 3}] = {1, 2};
      g[2] = 3;
      h = 1;
    elseif time < 0.6 then
      g = pre(g) + {1, 1, 1};
      h = 2;
    else
      if time < 0.8 then
        g[1] = 7;
        g[2:3] = {8, 9};
        h = 3;
      else
        g[1:2] = {17, 18};
        g[3] = 19;
        h = 4;
      end if;
    end if;
  elsewhen time > 0.95 then
    g[3] = 100;
    g[1:2] = {200, 300};
    h = 5;
  end when;
  // expect: g[2] @ 0.4 = 3
  // expect: g[1] @ 0.55 = 2
  // expect: g[3] @ 0.75 = 9
  // expect: g[2] @ 0.92 = 18
  // expect: g[2] @ 1 = 300
  // expect: h @ 1 = 5
end Run;
