// A size that reads itself has none.
model Run
  parameter Real A[size(A, 1), 2] = [1, 0; 0, 1]; // error E0211: the size of `A` depends on itself
end Run;
