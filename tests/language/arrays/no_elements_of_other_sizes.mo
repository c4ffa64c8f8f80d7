// Arrays without elements fit each other only where all their sizes do.
model Run
  parameter Real a[:, :] = zeros(0, 3);
  parameter Real b[:, :] = zeros(0, 2);
  parameter Real c[:, :] = a + b; // error E0204: the operator has no meaning for array of empty and array of empty
  Real y = time;
end Run;
