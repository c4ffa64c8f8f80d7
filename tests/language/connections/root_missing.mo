record R
  Real x;
  function equalityConstraint
    input R a;
    input R b;
    output Real residue[0];
  algorithm
  end equalityConstraint;
end R;
connector C
  R r;
  flow Real f;
end C;
model Rod
  C a;
  C b;
equation
  Connections.branch(a.r, b.r);
  a.r.x = b.r.x;
  a.f + b.f = 0;
end Rod;
model Fixed
  C c;
equation
  Connections.root(c.r);
  c.r.x = 1;
end Fixed;
model Hinge
  C a;
  C b;
equation
  Connections.branch(a.r, b.r);
  Connections.branch(b.r, a.r); // error E0305: this `Connections.branch` closes a loop of branches, which no connection can open
  Connections.root(a.r);
  a.f + b.f = 0;
end Hinge;
model Clamped
  C a;
  C b;
equation
  Connections.branch(a.r, b.r); // error E0305: `k.a.r` and `k.b.r` are both roots, and branches relate one to the other
  Connections.root(a.r);
  Connections.root(b.r);
  a.f + b.f = 0;
end Clamped;
model Run
  Rod p;
  Rod q;
  Fixed fixed;
  Rod s;
  Hinge h;
  Clamped k;
equation
  connect(p.b, q.a); // error E0305: nothing that is connected to `p.a.r` determines it: there is no root
  connect(fixed.c, s.a);
  Connections.branches(p.a.r, p.b.r); // error E0201: there is no `Connections.branches`
  Connections.branch(p.a.r); // error E0214: `Connections.branch` takes two records
end Run;
