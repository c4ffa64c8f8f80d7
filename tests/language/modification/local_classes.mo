model Mods
  model Med
    type Density = Real(start=1);
    model Inner
      parameter Real k=1;
      Real y = k;
    end Inner;
    Density d;
    Inner i;
  equation
    der(d) = -d;
  end Med;
  Med m(Density(start=10), Inner(k=4), d(fixed=true));
  // expect: m.d @ 1 = 10*exp(-1)
  // expect: m.i.y @ 1 = 4
end Mods;
