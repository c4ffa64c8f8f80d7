package Media
  partial package PartialMedium
    constant String mediumName = "unset";
    constant Real rho0;
    type Density = Real(final quantity="Density", unit="kg/m3", min=0, start=1);
    type Temperature = Real(unit="K", start=300);
    record State
      Real p(unit="Pa");
      Temperature T;
    end State;
    replaceable partial function density
      input State s;
      output Density d;
    end density;
  end PartialMedium;
  package Water
    extends PartialMedium(mediumName="water", rho0=998, Density(start=998, nominal=1000));
    redeclare function extends density
    algorithm
      d := rho0*(1 + 4.5e-10*(s.p - 1e5));
    end density;
  end Water;
  model Vessel
    replaceable package Medium = PartialMedium;
    Medium.Density d(start = 5);
    Medium.State s(T = 293);
  equation
    s.p = 1e5 + 1e7*time;
    d = Medium.density(s);
  end Vessel;
  model Run
    Vessel v(redeclare package Medium = Water);
    // expect: v.d @ 1 = 998*(1+4.5e-3)
  end Run;
end Media;
