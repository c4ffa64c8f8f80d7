// The base of a local class does not exist in the package that was redeclared: that is said, and the one of the text is not taken.
package P
  package Empty
  end Empty;
  package S1
    model K
      Real y = 1;
    end K;
  end S1;
  package S2
  end S2;
  model Part
    replaceable package S = S1 constrainedby Empty;
    model N
      extends S.K; // error E0202: `P.S2` has no class `K`
    end N;
    model Unused
      extends S.K;
    end Unused;
    N n;
  end Part;
  model Run
    Part part(redeclare package S = S2);
  end Run;
end P;
