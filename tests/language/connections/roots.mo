// Who determines a record that connections only pass on (9.4): a root, else the potential root of the lowest priority in what is
// connected; conditions ask for it.  A check without residues takes the place of an equality that closes a loop.
record Reference
  Real angle;
  function equalityConstraint
    input Reference a;
    input Reference b;
    output Real residue[0];
  algorithm
    assert(abs(a.angle - b.angle) < 1E-6, "angles differ");
  end equalityConstraint;
end Reference;
connector Pin
  Reference reference;
  Real v;
  flow Real i;
end Pin;
model Source
  Pin p;
  parameter Real angle = 1;
equation
  Connections.root(p.reference);
  p.reference.angle = angle;
  p.v = 1;
end Source;
model Ground
  Pin p;
  parameter Integer priority = 256;
  Boolean chosen = Connections.isRoot(p.reference);
equation
  Connections.potentialRoot(p.reference, priority);
  if Connections.isRoot(p.reference) then
    p.reference.angle = priority*time;
  end if;
  p.v = 0;
end Ground;
model Resistor
  Pin p;
  Pin n;
equation
  Connections.branch(p.reference, n.reference);
  p.reference.angle = n.reference.angle;
  p.i + n.i = 0;
  p.v - n.v = p.i;
end Resistor;
model Chain "Two resistors beside each other close a loop"
  Ground g;
  Resistor r[2];
  Ground h(priority = 3);
equation
  connect(g.p, r[1].p);
  connect(g.p, r[2].p);
  connect(h.p, r[1].n);
  connect(h.p, r[2].n);
end Chain;
model Run
  Source source;
  Resistor load;
  Ground ground;
  Chain chain;
  Ground several[3](priority = {7, 6, 7});
  Resistor between[2];
equation
  connect(source.p, load.p);
  connect(load.n, ground.p);
  for k in 1:2 loop
    connect(several[k].p, between[k].p);
    connect(between[k].n, several[k + 1].p);
  end for;
  // expect: ground.chosen @ 1 = 0
  // expect: ground.p.reference.angle @ 1 = 1
  // expect: chain.g.chosen @ 1 = 0
  // expect: chain.h.chosen @ 1 = 1
  // expect: chain.g.p.reference.angle @ 1 = 3
  // expect: several[1].chosen @ 1 = 0
  // expect: several[2].chosen @ 1 = 1
  // expect: several[3].p.reference.angle @ 1 = 6
  // expect: load.p.i @ 1 = 1
end Run;
