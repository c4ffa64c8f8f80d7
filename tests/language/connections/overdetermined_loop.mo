// Two chains of joints begin and end at the same frame: the angle of one follows from the other.  A rotation has one degree of
// freedom and two variables, so that one connection of the loop must give one equation in place of two (9.4).
record Rotation
  Real c "Cosine";
  Real s "Sine";
  function equalityConstraint
    input Rotation a;
    input Rotation b;
    output Real residue[1];
  algorithm
    residue[1] := a.c*b.s - a.s*b.c;
  end equalityConstraint;
end Rotation;
connector Frame
  Rotation r;
  flow Real torque;
end Frame;
model Ground
  Frame f;
equation
  Connections.root(f.r);
  f.r = Rotation(1, 0);
end Ground;
partial model Two
  Frame a;
  Frame b;
  Boolean rooted = Connections.rooted(a.r);
equation
  a.torque + b.torque = 0;
end Two;
model Turned
  extends Two;
  Real angle;
equation
  Connections.branch(a.r, b.r);
  if Connections.rooted(a.r) then
    b.r.c = a.r.c*cos(angle) - a.r.s*sin(angle);
    b.r.s = a.r.s*cos(angle) + a.r.c*sin(angle);
  else
    a.r.c = b.r.c*cos(angle) + b.r.s*sin(angle);
    a.r.s = b.r.s*cos(angle) - b.r.c*sin(angle);
  end if;
end Turned;
model Joint
  extends Turned(angle(start = -0.4));
equation
  a.torque = 0;
end Joint;
model Run
  Ground ground;
  Turned prescribed(angle = 0.3*time);
  Turned fixed(angle = 0.5);
  Joint joint;
equation
  connect(ground.f, prescribed.a);
  // These are turned round: their frames `b` are nearer to the ground.
  connect(ground.f, fixed.b);
  connect(fixed.a, joint.b);
  connect(joint.a, prescribed.b);
  // stop: 2
  // The ground, `prescribed` and back: 0.3*time = -0.5 - angle
  // expect: joint.angle @ 1 = -0.8
  // expect: joint.angle @ 2 = -1.1
  // expect: prescribed.b.r.c @ 2 = cos(0.6)
  // expect: joint.a.r.s @ 2 = sin(0.6)
  // expect: prescribed.rooted @ 1 = 1
  // expect: fixed.rooted @ 1 = 0
  // expect: joint.rooted @ 1 = 0
end Run;
