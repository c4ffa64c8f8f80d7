package Medium
  constant Real rho = 1;
end Medium;
model A
  replaceable package Fluid = Medium;
end A;
model B
  replaceable package Fluid = Medium(rho = 2); // error E0205: `Fluid` is declared twice
end B;
model Run
  extends A;
  extends B;
end Run;
