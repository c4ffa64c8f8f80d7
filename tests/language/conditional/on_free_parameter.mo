// What the start finds cannot decide which components there are.
model C
  Real z = 1;
end C;
model M
  parameter Real k(fixed = false, start = 1);
  parameter Real m = 2*k; // error E0206: the value of `k` is found at the start (`fixed = false`), but decides sizes or structure
  C c if m > 1;
initial equation
  k^2 = 4;
end M;
