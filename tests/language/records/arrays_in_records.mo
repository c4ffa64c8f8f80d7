package Pk
  record Base
    parameter Real a = 1;
    Real b = 2;
  end Base;
  record Ext
    extends Base(a = 3);
    Real v[2] = {a, b};
  end Ext;
  function norm
    input Ext e;
    input Real w[:] = {1, 1};
    output Real r;
  protected
    Integer n = size(w, 1);
  algorithm
    r := 0;
    for i in 1:n loop
      r := r + w[i]*e.v[i]^2;
    end for;
    r := sqrt(r);
  end norm;
  model Run
    parameter Ext e(a = 3, b = 4);
    parameter Ext list[2] = {Ext(a=1, b=0, v={1,0}), Ext(a=0, b=2, v={0,2})};
    Real r = norm(e);
    Real r2 = norm(e, {1, 0});
    Real r3 = norm(list[2]);
    Real s = sum(norm(list[i]) for i in 1:2);
    // expect: r @ 1 = 5
    // expect: r2 @ 1 = 3
    // expect: r3 @ 1 = 2
    // expect: s @ 1 = 3
  end Run;
end Pk;
