// `array(a, b)` of records.
package P
  record R
    Real x = 1;
    Integer n = 2;
  end R;
  model Run
    parameter R r[2] = array(R(x = 3), R(n = 5));
    R s[2] = array(R(x = time), R(4));
    Real t[2, 2] = array(array(1, 2), array(3, 4));
    parameter Integer n[:] = array(size(r, 1), r[2].n);
    // expect: r[1].x @ 0 = 3
    // expect: r[2].n @ 0 = 5
    // expect: s[1].x @ 1 = 1
    // expect: s[2].x @ 1 = 4
    // expect: t[2,1] @ 0 = 3
    // expect: n[2] @ 0 = 5
  end Run;
end P;
