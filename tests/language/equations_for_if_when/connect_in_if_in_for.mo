// Connections that depend on the loop variable.
package B
  connector P
    Real v; flow Real i;
  end P;
  model R
    P a, b; parameter Real r = 1;
  equation
    a.v - b.v = r*a.i; a.i + b.i = 0;
  end R;
  model S
    P a; parameter Real v = 0;
  equation
    a.v = v;
  end S;
  model Run
    parameter Integer n = 4;
    R r[n]; S hi(v=8), lo;
  equation
    for i in 1:n loop
      if i == 1 then
        connect(hi.a, r[i].a);
      else
        connect(r[i-1].b, r[i].a);
      end if;
      if i == n then
        connect(r[i].b, lo.a);
      end if;
    end for;
    // expect: r[2].a.i @ 1 = 2
  end Run;
end B;
