package Rd
  partial model Ctrl
    parameter Real k = 1;
    input Real e; output Real u;
  end Ctrl;
  model P
    extends Ctrl;
  equation
    u = k*e;
  end P;
  model PI
    extends Ctrl;
    parameter Real Ti = 1;
    Real s(start=0, fixed=true);
  equation
    Ti*der(s) = e;
    u = k*(e+s);
  end PI;
  model Plant
    replaceable P c(k = 3) constrainedby Ctrl(k = 5);
    replaceable Ctrl d = P(k=2);
    Real y(start=0, fixed=true);
  equation
    c.e = 1 - y;
    der(y) = c.u - y;
  end Plant;
  model Run
    replaceable model M = P;
  end Run;
  model Run2
    replaceable P c(k = 3) constrainedby Ctrl(k = 5);
    Real y = c.u;
  equation
    c.e = 1;
  end Run2;
  model Run3
    Run2 a;
    Run2 b(redeclare PI c(Ti = 2));
    extends Run2(redeclare replaceable PI c);
    // expect: a.y @ 1 = 3
    // expect: b.y @ 1 = 5*1.5
    // expect: y @ 1 = 10
  end Run3;
end Rd;
