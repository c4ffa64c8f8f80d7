// What an inherited package names is looked up where its text stands, also for what it inherits itself, whatever was asked for before.
package P
  package U
    type Temperature = Real(unit = "K");
  end U;
  package Media
    import SI = P.U;
    package Base
      type Temperature = SI.Temperature(min = 1);
      function temp
        input Real h;
        output Temperature T = h/1000;
      algorithm
      end temp;
    end Base;
  end Media;
  model Lump
    replaceable package Medium = Media.Base;
    parameter Medium.Temperature T0 = 300;
  end Lump;
  model Volume
    extends Lump;
    Medium.Temperature T = Medium.temp(3e5);
  end Volume;
  model Plain
    extends Volume;
  end Plain;
  model Moist
    extends Volume;
  end Moist;
  model A
    package Medium = Media.Base;
    replaceable Plain v(redeclare package Medium = Medium);
  end A;
end P;
model Run
  extends P.A(redeclare P.Moist v);
  // expect: v.T @ 1 = 300
  // expect: v.T0 @ 1 = 300
end Run;
