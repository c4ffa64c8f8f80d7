// Ranges of Integers are exact, a Real step that misses the end by rounding counts, ranges against their step are empty
// (Modelica 3.6, section 10.4.3): in reductions, loops run symbolically, compiled and before the run, subscripts, arrays, sizes.
type E = enumeration(a, b, c);
function turns
  input Integer from;
  input Integer by;
  input Integer to;
  output Integer n = 0;
algorithm
  for i in from:by:to loop
    n := n + 1;
  end for;
end turns;
function compiled
  input Real from;
  input Real by;
  input Real to;
  output Real y[2];
protected
  Real w = 0;
  Integer n = 0;
algorithm
  for x in from:by:to loop
    n := n + 1;
    w := x;
  end for;
  y := {n, w};
end compiled;
function compiled_whole
  input Integer from;
  input Integer by;
  input Integer to;
  output Integer n = 0;
protected
  Integer k = from;
algorithm
  while k < from + 1 loop
    k := k + 1;
  end while;
  for i in from:by:to loop
    n := n + i;
  end for;
end compiled_whole;
function real_range
  input Real a;
  output Real y;
protected
  Real v[3] = 1.5:0.5:2.5;
  Integer n = 3;
  Integer w[n] = 1:n;
algorithm
  y := v*w + a;
end real_range;
model Run
  Real x = sum(if i < 0 then 1000 else i for i in 10:-3:0);
  Real empty = 7 + sum(1000 for i in 5:1) + sum(1000 for i in 1:-1:2) + product(i for i in 3:-7:4);
  Integer t[4] = {turns(10, -3, 0), turns(0, 3, 10), turns(1, 1, 0), turns(0, -5, -10)};
  discrete Real c[2](start = {0, 0}, fixed = true);
  discrete Real d[2](start = {0, 0}, fixed = true);
  Integer e(start = 0, fixed = true);
  Real v[5] = {1, 2, 3, 4, 5}*time;
  Real odd[3] = v[5:-2:1];
  Real tenth[11] = (0:0.1:1)*time;
  Real m[size(10:-3:0, 1)];
  Real literals = sum(Integer(l) for l in E.a:E.c) + sum(1 for b in false:true) + sum(1 for l in E.c:E.a);
  parameter Integer many = turns(10, -3, 0);
  Real sized[many] = fill(time, many);
  Real r = real_range(time);
equation
  for k in 10:-3:0 loop
    m[div(k - 1, 3) + 1] = k*time;
  end for;
  when time > 0.5 then
    c = compiled(time - pre(c[1])*0 - time, 0.1, 1);
    d = compiled(1, -0.1, time - time);
    e = compiled_whole(10 + pre(e), -3, 0);
  end when;
  // expect: x @ 1 = 22
  // expect: empty @ 1 = 8
  // expect: t[1] @ 1 = 4
  // expect: t[2] @ 1 = 4
  // expect: t[3] @ 1 = 0
  // expect: t[4] @ 1 = 3
  // expect: c[1] @ 1 = 11
  // expect: c[2] @ 1 = 1
  // expect: d[1] @ 1 = 11
  // expect: d[2] @ 1 = 0
  // expect: e @ 1 = 22
  // expect: odd[1] @ 1 = 5
  // expect: odd[3] @ 1 = 1
  // expect: tenth[11] @ 1 = 1
  // expect: m[4] @ 1 = 10
  // expect: m[1] @ 1 = 1
  // expect: literals @ 1 = 8
  // expect: sized[4] @ 1 = 1
  // absent: sized[5]
  // expect: r @ 1 = 1.5 + 4 + 7.5 + 1
end Run;
