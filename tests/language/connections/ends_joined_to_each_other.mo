// Both ends of a component at one place: it does nothing.  A follower, a wall that stores something and what a class joins inside are left alone.
// model: Run
connector Pin
  Real v;
  flow Real i;
end Pin;
model R
  Pin p;
  Pin n;
  parameter Real k = 2;
equation
  p.i + n.i = 0;
  p.v - n.v = k*p.i;
end R;
model Level
  Pin p;
equation
  p.v = 3;
end Level;
model Ground
  Pin p;
equation
  p.v = 0;
end Ground;
model Amplifier
  Pin plus;
  Pin minus;
  Pin out;
equation
  plus.i = 0;
  minus.i = 0;
  plus.v = minus.v;
end Amplifier;
model Wall
  Pin p;
  Pin n;
  Real v(start = 0, fixed = true);
equation
  p.v - v = 2*p.i;
  n.v - v = 2*n.i;
  der(v) = p.i + n.i;
end Wall;
model Inside
  Pin p;
  R r; // warning W0302: `r.p` and `r.n` are connected to each other, so no difference between them acts on `r`
equation
  connect(p, r.p);
  connect(p, r.n);
end Inside;
model Run
  Level level;
  Ground ground;
  R between;
  R idle; // warning W0302: `idle.p` and `idle.n` are connected to each other, so no difference between them acts on `idle`
  R load;
  R rows[2];
  Amplifier follower;
  Inside inside;
  Wall wall;
equation
  connect(wall.p, level.p);
  connect(wall.n, level.p);
  connect(level.p, between.p);
  connect(between.n, ground.p);
  connect(idle.p, level.p);
  connect(level.p, idle.n);
  connect(follower.plus, level.p);
  connect(follower.minus, follower.out);
  connect(follower.out, load.p);
  connect(load.n, ground.p);
  connect(inside.p, level.p);
  for k in 1:2 loop
    connect(rows[k].p, level.p);
    connect(rows[k].n, ground.p);
  end for;
  // expect: between.p.i @ 1 = 1.5
  // expect: idle.p.i @ 1 = 0
  // expect: load.p.i @ 1 = 1.5
  // expect: wall.v @ 1 = 1.896361676485673
end Run;
