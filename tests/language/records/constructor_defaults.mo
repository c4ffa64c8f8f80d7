// Constructors keep what a derived record, a short definition or its own declarations say of fields that get no argument
// (Modelica 3.6, section 12.6.1); positions count inherited fields where their `extends` stands; what is final is not an argument.
record Base
  parameter Real a = 1;
  parameter Real b = 2*a;
end Base;
record Derived
  parameter Real z = 0;
  extends Base(a = 5);
end Derived;
record Short = Base(a = 7);
record Twice
  extends Base(b = a + 100);
  extends More;
end Twice;
record More
  parameter Real late = early + 1;
  parameter Real early = 3;
end More;
record Inner
  Real x = 1;
  Real y = 10*x;
end Inner;
record Outer
  Inner i(x = k);
  Real k = 4;
  Inner list[2](x = {k, 2*k}, each y = 6);
end Outer;
record Deep
  extends Outer(i(y = 77), k = 9);
end Deep;
record Fixed
  final parameter Real locked = 3;
  constant Real c = 2;
  Real free = c*locked;
  Real last = 0;
end Fixed;
function total
  input Outer o;
  output Real y;
algorithm
  y := o.i.x + 10*o.i.y + 1000*o.k + 1e5*o.list[1].x + 1e6*o.list[2].x + 1e7*o.list[2].y;
end total;
function unlocked
  input Fixed f;
  output Real y;
algorithm
  y := f.locked + 10*f.c + 100*f.free + 1000*f.last;
end unlocked;
function both
  input Base r;
  output Real y = r.a + 10*r.b;
end both;
function later
  input Twice r;
  output Real y = r.late;
end later;
model Run
  parameter Base p = Derived();
  parameter Base q = Derived(9, 2, 3);
  parameter Base r = Derived(b = 30, z = 1);
  parameter Base s = Short();
  Real vpa = p.a;
  Real vpb = p.b;
  Real vqa = q.a;
  Real vqb = q.b;
  Real vra = r.a;
  Real vrb = r.b;
  Real vsa = s.a;
  Real vsb = s.b;
  Real tb = both(Base(b = time));
  Real td = both(Derived(1));
  Real ts = both(Short());
  Real tw = both(Twice());
  Real late = later(Twice()) + 10*later(Twice(early = 5));
  Real o = total(Outer());
  Real d = total(Deep());
  Real g = total(Outer(Inner(2), 5));
  Real f = unlocked(Fixed(4, 1, 2)) + unlocked(Fixed());
  // expect: vpa @ 1 = 5
  // expect: vpb @ 1 = 10
  // expect: vqa @ 1 = 2
  // expect: vqb @ 1 = 3
  // expect: vra @ 1 = 5
  // expect: vrb @ 1 = 30
  // expect: vsa @ 1 = 7
  // expect: vsb @ 1 = 14
  // expect: tb @ 1 = 1 + 10
  // expect: td @ 1 = 5 + 100
  // expect: ts @ 1 = 7 + 140
  // expect: tw @ 1 = 1 + 10*101
  // expect: late @ 1 = 4 + 60
  // expect: o @ 1 = 4 + 400 + 4000 + 4e5 + 8e6 + 6e7
  // expect: d @ 1 = 9 + 770 + 9000 + 9e5 + 18e6 + 6e7
  // expect: g @ 1 = 2 + 200 + 5000 + 5e5 + 10e6 + 6e7
  // expect: f @ 1 = 3 + 40 + 100 + 2000 + 3 + 20 + 600
end Run;
