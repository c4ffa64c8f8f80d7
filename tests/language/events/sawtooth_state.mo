model Edge2
  Real x(start=0.0, fixed=true);
  Boolean up(start=true, fixed=true);
  Integer n(start=0, fixed=true);
equation
  der(x) = if up then 1 else -2;
  when x > 0.3 then
    up = false;
  elsewhen x < 0 then
    up = true;
  end when;
  when {edge(up), not up} then
    n = pre(n) + 1;
  end when;
  // expect: n @ 1 = 4
  // stop: 1
end Edge2;
