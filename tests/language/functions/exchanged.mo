// All results of a call are taken before any variable changes, in compiled functions, too.
model Run
  function exchanged
    input Real a;
    input Real b;
    output Real c;
    output Real d;
  algorithm
    c := b;
    d := a;
  end exchanged;
  function f
    input Real x;
    output Real y;
    output Real z;
  protected
    Real v[2] = {1, 2};
    Integer k = 0;
  algorithm
    y := x;
    z := 10;
    while k < 3 loop
      (y, z) := exchanged(y, z);
      (v[1], v[2]) := exchanged(v[1], v[2]);
      k := k + 1;
    end while;
    y := y + 100*v[1] + 1000*v[2];
  end f;
  function g
    input Real t;
    input Real o[4];
    input Boolean first;
    output Real y;
    output Real z;
  protected
    Integer k;
  algorithm
    k := 1;
    for i in 1:2:3 loop
      if t >= o[i] then
        k := i + 2;
      end if;
    end for;
    if k > 4 then
      k := 1;
    end if;
    y := o[k];
    z := o[2];
    if not first then
      (y, z) := exchanged(y, z);
    end if;
  end g;
  Real y;
  Real z;
  Real v;
  Real w;
equation
  (y, z) = f(time);
  (v, w) = g(2*time, {1, 2, 3, 4}, false);
  // expect: y @ 0.5 = 1210
  // expect: z @ 0.5 = 0.5
  // expect: v @ 1 = 2
  // expect: w @ 1 = 3
end Run;
