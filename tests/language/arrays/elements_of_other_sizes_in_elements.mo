// The sizes that differ are inside an array that is inside an array, and connected as a whole.
package P
  connector RealInput = input Real;
  connector RealOutput = output Real;
  model Sum
    parameter Integer n = 1;
    RealInput u[n];
    RealOutput y;
  equation
    y = sum(u);
  end Sum;
  model Ramp
    parameter Real k = 1;
    RealOutput y;
  equation
    y = k*time;
  end Ramp;
  model Inner
    parameter Integer k = 1;
    Real a[k];
  equation
    for i in 1:k loop
      a[i] = i*time;
    end for;
  end Inner;
  model Outer
    parameter Integer k = 2;
    Inner s[2](k = {1, k});
    Real t = sum(s[2].a) + s[1].a[1];
  end Outer;
  model Run
    Sum b[3](n = {1, 2, 3});
    Ramp r[3](k = {1, 2, 3});
    Outer o[2](k = {2, 3});
    Real m = max(o.t);
    Real d[2];
    discrete Real h(start = 0, fixed = true);
    Integer z;
    parameter Integer last = 3;
  equation
    connect(r[1].y, b[1].u[1]);
    for i in 1:2 loop
      connect(r[i].y, b[2].u[i]);
    end for;
    connect(r.y, b[3].u);
    for i in 1:2 loop
      der(d[i]) = b[i + 1].y + (if i > 1 then sum(b[k].y for k in 1:i) else 0);
    end for;
    when b[last].y > 3 then
      h = pre(h) + b[last].u[end];
    end when;
    if last > 2 then
      z = 1;
    else
      b[7].y = 3;
      z = 2;
    end if;
  initial equation
    for i in 1:2 loop
      d[i] = b[i].y;
    end for;
    // expect: o[1].t @ 1 = 4
    // expect: o[2].t @ 1 = 7
    // expect: m @ 1 = 7
    // expect: d[1] @ 1 = 1.5
    // expect: d[2] @ 1 = 5
    // expect: h @ 1 = 1.5
    // expect: z @ 1 = 1
  end Run;
end P;
