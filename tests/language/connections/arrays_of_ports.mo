model E04 "array of models with inner each and connect arrays, sum of flows"
  connector P
    Real p(unit="Pa"); flow Real q(unit="m3/s");
  end P;
  model Tank
    P port[n](each p(start=1e5));
    parameter Integer n = 2;
    parameter Real C = 1e-9;
    Real p(start=1e5, fixed=true);
  equation
    C*der(p) = sum(port.q);
    port.p = fill(p, n);
  end Tank;
  model Src
    P port; parameter Real q=1e-6;
  equation
    port.q = -q;
  end Src;
  Tank t(n=3);
  Src s[3](q={1e-6,2e-6,3e-6});
equation
  connect(s.port, t.port);
  // expect: t.p @ 1 = 1e5+6e-6/1e-9
end E04;
