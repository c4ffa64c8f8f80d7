// The same short definition inherited along two ways is one element, whatever the comments say.
package Medium
  constant Real rho = 1;
end Medium;
package Water
  extends Medium(rho = 1000);
end Water;
model A
  replaceable package Fluid = Medium "one" annotation(choicesAllMatching = true);
  Real a = Fluid.rho;
end A;
model B
  replaceable package Fluid = Medium "two";
  Real b = Fluid.rho;
end B;
model Both
  extends A;
  extends B;
end Both;
model Run
  Both both(redeclare package Fluid = Water);
  // expect: both.a @ 1 = 1000
  // expect: both.b @ 1 = 1000
end Run;
