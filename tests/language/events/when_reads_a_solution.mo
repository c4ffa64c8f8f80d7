// At an event discrete and continuous equations hold together (Modelica 3.6, section 8.6): what a `when` reads of a loop, or of a
// rate, is the value that goes with the discrete variables of that event.
model Ring
  Real y, z;
  discrete Real d(start = 0, fixed = true);
  Real s = if time >= 0.5 then 2 else 1;
equation
  y + 0.5*z = s;
  z + 0.25*y = 0.5*s;
  when time >= 0.5 then
    d = y;
  end when;
end Ring;
model Run
  Ring ring;
  Real x(start = 0, fixed = true), w(start = 1, fixed = true), v(start = 1, fixed = true);
  discrete Real s(start = 0, fixed = true), rate(start = 0, fixed = true), chain(start = 0, fixed = true);
  Real a, b;
  Integer n(start = 0, fixed = true);
equation
  der(x) = if s > 1 then -1 else 1;
  when time >= 0.25 then
    s = 2;
  end when;
  when time >= 0.25 then
    rate = der(x);
  end when;
  // A loop through a discrete variable of the same event.
  a + b = 1 + n;
  a - 0.5*b = 1;
  when sample(0.25, 0.25) then
    n = pre(n) + 1;
    chain = a;
  end when;
  der(w) = 0;
  der(v) = 0;
  when time >= 0.5 then
    reinit(w, b);
    reinit(v, -0.5*pre(v) + ring.y);
  end when;
  // s = 2: y = (2 - 0.5*1)/(1 - 0.125)
  // expect: ring.d @ 1 = 12/7
  // expect: rate @ 1 = -1
  // n = 2, 3, 4 at 0.5, 0.75, 1: b = 2*n/3, a = 1 + n/3
  // expect: chain @ 0.3 = 4/3
  // expect: chain @ 0.6 = 5/3
  // expect: chain @ 0.8 = 2
  // expect: w @ 1 = 4/3
  // expect: v @ 1 = 12/7 - 0.5
end Run;
