// Linear systems and least squares by functions of LAPACK, computed at translation; values of declarations in any order.  Variables that
// only the clause `external` names are used.
function solve
  input Real A[:, size(A, 1)];
  input Real b[size(A, 1)];
  output Real x[size(A, 1)] = b;
  output Integer info;
protected
  Integer n = size(A, 1);
  Real Awork[size(A, 1), size(A, 1)] = A;
  Integer ipiv[size(A, 1)];
external "FORTRAN 77" dgesv(n, 1, Awork, n, ipiv, x, n, info);
end solve;
function fit
  input Real A[:, :];
  input Real b[size(A, 1)];
  output Real x[max(rows, columns)] = cat(1, b, zeros(max(rows, columns) - rows));
  output Integer info;
  output Integer rank;
protected
  Integer rows = size(A, 1);
  Integer columns = size(A, 2);
  Real Awork[size(A, 1), size(A, 2)] = A;
  Integer jpvt[size(A, 2)] = zeros(columns);
  Real work[100];
external "FORTRAN 77" dgelsy(rows, columns, 1, Awork, rows, x, rows, jpvt, 1e-10, rank, work, 100, info);
end fit;
model Run
  parameter Real x[2] = solve({{2, 1}, {1, 3}}, {3, 5});
  parameter Real line[3] = fit({{1, 0}, {1, 1}, {1, 2}}, {1.1, 2.8, 5.1});
  Real y[2] = solve({{2, 1}, {1, 3}}, {3, 5})*time;
  // expect: x[1] @ 0 = 0.8
  // expect: x[2] @ 0 = 1.4
  // expect: line[1] @ 0 = 1
  // expect: line[2] @ 0 = 2
  // expect: y[2] @ 1 = 1.4
end Run;
