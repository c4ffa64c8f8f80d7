// What a package holds is found from classes alone: a package of its own name inside one would not be the one of the component.
package P
  package Oil
    constant Real k = 3;
  end Oil;
  package Use
    replaceable package Medium = Oil;
    constant Real k = Medium.k;
  end Use;
  model Run
    replaceable package Medium = Oil;
    package V = Use(redeclare package Medium = Medium); // error E0208: `P.Run.V.Medium` extends itself
    Real x = V.k;
  end Run;
end P;
