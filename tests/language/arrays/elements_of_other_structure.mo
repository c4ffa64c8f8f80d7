// A Boolean parameter chooses the equations of each element, and what components it has.
model Run
  connector Pin
    Real v;
    flow Real i;
  end Pin;
  model Source
    parameter Real v = 0;
    Pin p;
  equation
    p.v = v;
  end Source;
  model Resistor
    parameter Real R = 1;
    Pin p;
    Pin n;
  equation
    p.v - n.v = R*p.i;
    p.i + n.i = 0;
  end Resistor;
  model Cell
    parameter Boolean leaks = false;
    parameter Real R = 1;
    Pin p;
    Pin n;
    Resistor along(R = R);
    Resistor leak(R = 2) if leaks;
    Source ground if leaks;
    Real lost;
  equation
    connect(p, along.p);
    connect(along.n, n);
    connect(n, leak.p);
    connect(leak.n, ground.p);
    if leaks then
      lost = n.v/2;
    else
      lost = 0;
    end if;
  end Cell;
  Cell c[3](leaks = {true, false, true}, R = {1, 2, 1}); // warning W0301: nothing is connected to `c[3].n`, so nothing flows through it
  Source source(v = 5);
  Real lost = sum(c.lost);
equation
  connect(source.p, c[1].p);
  for i in 1:2 loop
    connect(c[i].n, c[i + 1].p);
  end for;
  // The last node over 2 to ground, 3 in front of it, beside 2, behind 1: 5*(10/7)/(17/7) = 50/17 at the first one.
  // expect: c[1].n.v @ 1 = 50/17
  // expect: c[3].n.v @ 1 = 20/17
  // expect: lost @ 1 = 35/17
  // expect: source.p.i @ 1 = -35/17
end Run;
