// Fields of a type that is an array have its sizes in functions that are run symbolically, compiled, or computed before the run
// (Modelica 3.6, section 10.1).
package P
  type Pair = Real[2];

  record R
    Pair v;
    Real k;
  end R;

  function make
    input Real u;
    output R r;
  algorithm
    r.k := u;
    for i in 1:2 loop
      r.v[i] := i*u;
    end for;
  end make;

  function total
    input Real u;
    output Real y;
  protected
    R r;
    Real w;
  algorithm
    r := make(u);
    w := 0;
    while w < u loop
      w := w + 1;
      r.v[1] := r.v[1] + w;
    end while;
    y := r.v[1] + r.v[2] + r.k;
  end total;

  model Run
    R made = make(time);
    Real compiled = total(time + 1.5);
    parameter Integer size = integer(total(2.5));
    Real a[size] = fill(1, size);
    Real before = sum(a);
    // expect: made.v[2] @ 1 = 2
    // expect: compiled @ 1 = 16
    // expect: before @ 1 = 16
  end Run;
end P;
