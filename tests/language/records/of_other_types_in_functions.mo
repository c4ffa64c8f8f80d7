model Run
  type E = enumeration(a, b, c);
  record R
    Real a = 1;
    E e = E.b;
    Boolean on = false;
    Integer n = 3;
  end R;
  function f
    input R r;
    input R s = R(a = r.a + 1);
    output Real y = r.a + 10*s.a + (if r.on then 100 else 0) + 1000*r.n + (if r.e == E.b then 1e4 else 0);
  end f;
  function best_of
    input R r[:];
    output R best = r[1];
  protected
    R here;
  algorithm
    for i in 2:size(r, 1) loop
      here := r[i];
      if here.a > best.a then
        best := here;
      end if;
    end for;
  end best_of;
  discrete Real k(start = 0, fixed = true);
  Real y = f(R(on = true, n = 4));
  Real z = f(R(2), R(5));
  Real w = f(best_of({R(time), R(3, E.c), R()}));
  R rr = best_of({R(1), R(time + 1)});
equation
  when time > 0.5 then
    k = f(R(a = pre(k) + 1));
  end when;
  // expect: y @ 1 = 1 + 20 + 100 + 4000 + 1e4
  // expect: z @ 1 = 2 + 50 + 3000 + 1e4
  // expect: w @ 1 = 3 + 40 + 3000
  // expect: rr.a @ 1 = 2
  // expect: k @ 1 = 1 + 20 + 3000 + 1e4
end Run;
