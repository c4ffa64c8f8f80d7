model E03 "state machine with enumeration, sample, algorithm if"
  type St = enumeration(idle, run, stop);
  St s(start=St.idle, fixed=true);
  Integer n(start=0, fixed=true);
  Boolean go = time > 0.25;
equation
  when sample(0.1,0.1) then
    s = if pre(s) == St.idle and go then St.run elseif pre(s) == St.run and pre(n) > 2 then St.stop else pre(s);
    n = if s == St.run then pre(n)+1 else pre(n);
  end when;
  // expect: s @ 0.2 = 1
  // expect: s @ 0.35 = 2
  // expect: s @ 0.95 = 3
  // expect: n @ 0.95 = 3
end E03;
