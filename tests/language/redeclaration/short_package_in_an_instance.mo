// What a short definition of a package redeclares is read around it: a package of its own name there, for the instance as well.
package P
  package Oil
    constant Real k = 3;
  end Oil;
  package Water
    constant Real k = 4;
  end Water;
  package Use
    replaceable package Medium = Oil;
    constant Real k = Medium.k;
  end Use;
  model User
    replaceable package Medium = Oil;
    package V = Use(redeclare package Medium = Medium);
    Real x = V.k;
  end User;
  model Run
    User oil;
    User water(redeclare package Medium = Water);
    // expect: oil.x @ 1 = 3
    // expect: water.x @ 1 = 4
  end Run;
end P;
