// Initial equations and algorithms say where discrete variables start; `integer` there is a value, no event (8.6).
model Run
  Integer count;
  Integer other;
  Real begin;
initial equation
  count = integer((time - 0.2)/0.4);
initial algorithm
  other := integer((time - 0.2)/0.4);
  begin := 0.2 + other*0.4;
equation
  when time >= (pre(count) + 1)*0.4 + 0.2 then
    count = pre(count) + 1;
  end when;
  when time >= (pre(other) + 1)*0.4 + 0.2 then
    other = pre(other) + 1;
    begin = time;
  end when;
  // expect: count @ 0 = -1
  // expect: count @ 0.1 = -1
  // expect: count @ 0.4 = 0
  // expect: count @ 0.8 = 1
  // expect: begin @ 0 = -0.2
  // expect: begin @ 0.8 = 0.6
end Run;
