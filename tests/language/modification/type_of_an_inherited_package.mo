package C01
  package Med
    type Density = Real(unit="kg/m3", start=1);
    connector Pin
      Real v(start = 3);
    end Pin;
  end Med;
  package Heavy
    extends Med(Density(start=10));
  end Heavy;
  model Tank
    replaceable package M = Med;
    M.Density d(fixed=true);
  equation
    der(d) = 0;
  end Tank;
  model Run
    Tank a;
    Tank b(redeclare package M = Heavy);
    Tank c(redeclare package M = Med(Density(start=20)));
    // expect: a.d @ 1 = 1
    // expect: b.d @ 1 = 10
    // expect: c.d @ 1 = 20
  end Run;
end C01;
