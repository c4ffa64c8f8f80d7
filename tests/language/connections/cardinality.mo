// How often a connector is connected decides on equations (3.7.4.3); connections stand anywhere in the text.
connector Pin
  Real v;
  flow Real i;
end Pin;
model Part
  Pin p;
  Real n;
equation
  n = cardinality(p);
  if cardinality(p) == 0 then
    p.v = 5;
  else
    p.v = 10*time;
  end if;
end Part;
model Load
  Pin p;
equation
  p.v = 2*p.i;
end Load;
model Run
  // warning W0301: nothing is connected to `a.p`, so nothing flows through it
  Part a;
  Part b;
  Load c;
  // warning W0301: nothing is connected to `d[1].p`, so nothing flows through it
  Load d[2];
equation
  connect(b.p, c.p);
  for k in 1:2 loop
    if k > 1 then
      connect(b.p, d[k].p);
    end if;
  end for;
  // expect: a.p.v @ 1 = 5
  // expect: b.p.v @ 1 = 10
  // expect: b.n @ 1 = 2
  // expect: d[2].p.i @ 1 = 5
  // expect: d[1].p.i @ 1 = 0
end Run;
