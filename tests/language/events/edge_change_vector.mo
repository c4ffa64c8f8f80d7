model Chat "pre edge change"
  Boolean a = time > 0.2 and time < 0.6;
  Boolean b(start=false, fixed=true);
  Integer ups(start=0, fixed=true), chg(start=0, fixed=true), down(start=0,fixed=true);
  Real t1(start=-1, fixed=true);
equation
  when edge(a) then ups = pre(ups) + 1; end when;
  when change(a) then chg = pre(chg) + 1; end when;
  when not a then down = pre(down) + 1; end when;
  when {a, time > 0.8} then t1 = time; end when;
  b = if time >= 0.5 then true else pre(b);
  // expect: ups @ 1 = 1
  // expect: chg @ 1 = 2
  // expect: down @ 1 = 1
  // expect: t1 @ 0.7 = 0.2
  // expect: t1 @ 1 = 0.8
  // expect: b @ 0.5 = 1
end Chat;
