// What a function extends by its name stands before what it adds.
package Base
  replaceable partial function f
    input Real x;
    input Real y;
    output Real z;
  end f;
end Base;
package Own
  extends Base;
  redeclare function extends f
    input Integer n = 2;
  algorithm
    z := x + 10*y + 100*n;
  end f;
end Own;
model Run
  Real a = Own.f(1, 2);
  Real b = Own.f(1, 2, 3);
  Real c[3] = array(1, 2, time);
  // expect: a @ 1 = 221
  // expect: b @ 1 = 321
  // expect: c[3] @ 1 = 1
end Run;
