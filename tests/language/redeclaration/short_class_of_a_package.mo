// In a package, too, the modification of a short definition names what is around it, whatever the class has that is called so.
package P
  constant Real k = 5;
  model Q
    parameter Real x = 2;
    parameter Real k = 1; // warning W0202: `k` hides the constant `k`
    Real y = k + 10*x;
  end Q;
  record R
    Real a = 1;
    Real k = 2; // warning W0202: `k` hides the constant `k`
  end R;
  model F = Q(x = k);
  model E = Q(k = k);
  record R2 = R(a = k);
  package Sub
    model F = Q(x = k);
  end Sub;
  model H = Sub.F(x = k + 1);
  model Run
    F f;
    E e;
    R2 r;
    parameter R2 made = R2();
    H h;
    Sub.F inside[2];
    // expect: f.y @ 1 = 51
    // expect: e.y @ 1 = 25
    // expect: r.a @ 1 = 5
    // expect: made.a @ 1 = 5
    // expect: h.y @ 1 = 61
    // expect: inside[2].y @ 1 = 51
  end Run;
end P;
