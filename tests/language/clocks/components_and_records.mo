// Clocks through connectors to components of an array; enumerations, records, loops and conditions at ticks.
type Mode = enumeration(off, on, done);
record State
  Real a;
  Integer n;
end State;
connector ClockInput = input Clock;
connector ClockOutput = output Clock;
block Source
  ClockOutput y;
equation
  y = Clock(0.1);
end Source;
block User
  parameter Integer step = 1;
  ClockInput c;
  Mode m(start = Mode.off);
  State s(a(start = 0), n(start = 0));
  Integer x[3];
equation
  when c then
    s.n = previous(s.n) + step;
    s.a = previous(s.a) + 0.5;
    for i in 1:3 loop
      x[i] = i*s.n;
    end for;
    if s.n > 5 then
      m = Mode.done;
    elseif s.n > 2 then
      m = Mode.on;
    else
      m = previous(m);
    end if;
    assert(s.n < 100, "too many ticks");
  end when;
end User;
model Run
  Source source;
  User u[2](step = {1, 2});
equation
  for i in 1:2 loop
    connect(source.y, u[i].c);
  end for;
  // expect: u[1].s.n @ 0.95 = 10
  // expect: u[2].s.n @ 0.95 = 20
  // expect: u[1].s.a @ 0.95 = 5
  // expect: u[2].x[3] @ 0.05 = 6
  // expect: u[1].m @ 0.15 = 1
  // expect: u[1].m @ 0.25 = 2
  // expect: u[1].m @ 0.55 = 3
end Run;
