// A function whose assertion wants a discrete argument that has a value: it is not called with another one at the start.
package P
  function f
    input Integer k;
    input Real u;
    output Real y;
  algorithm
    assert(k >= 1, "k is not positive");
    y := k*u;
  end f;
end P;

model Run
  Boolean up = time >= 0;
  Integer r = if up then 2 else 3;
  Real x(start = 1, fixed = true);
equation
  der(x) = -P.f(r, x);
  // expect: x @ 1 = exp(-2)
end Run;
