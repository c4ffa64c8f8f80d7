// What stands in a package of an instance reads the constants of the instance: one constant has one value.
package P
  package S1
    constant Real c = 1;
  end S1;
  package S2
    extends S1(c = 2);
  end S2;
  model Part
    replaceable package S = S1;
    constant Real d = S.c;
    package L
      constant Real z = d;
      constant Real w = S.c;
      function f
        output Real y = d + z;
      algorithm
      end f;
      model M
        parameter Real p = z;
        Real y = z;
        Real around = d;
        Real named = L.z;
        Real called = f();
        Other other;
      end M;
      model Other
        Real y = z;
      end Other;
      package Inner
        constant Real v = 10*z;
        model Deep
          Real y = v;
        end Deep;
      end Inner;
    end L;
    L.M m;
    L.Inner.Deep deep;
    Real q = L.z;
    Real r = L.w;
    Real s = L.f();
  end Part;
  model Heir
    extends Part;
  end Heir;
  model Run
    Part plain;
    Heir a(redeclare package S = S2);
    Part b(d = 5);
    // expect: plain.m.y @ 0 = 1
    // expect: plain.s @ 0 = 2
    // expect: a.q @ 0 = 2
    // expect: a.r @ 0 = 2
    // expect: a.s @ 0 = 4
    // expect: a.m.p @ 0 = 2
    // expect: a.m.y @ 0 = 2
    // expect: a.m.around @ 0 = 2
    // expect: a.m.named @ 0 = 2
    // expect: a.m.called @ 0 = 4
    // expect: a.m.other.y @ 0 = 2
    // expect: a.deep.y @ 0 = 20
    // expect: b.q @ 0 = 5
    // expect: b.m.y @ 0 = 5
    // expect: b.m.around @ 0 = 5
    // expect: b.deep.y @ 0 = 50
  end Run;
end P;
