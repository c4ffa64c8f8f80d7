// A linear system whose matrix and right side change during the run, and one that needs its rows in another order.
package P
  function solve
    input Real A[:, size(A, 1)];
    input Real b[size(A, 1)];
    output Real x[size(A, 1)] = b;
    output Integer info;
  protected
    Real Awork[size(A, 1), size(A, 1)] = A;
    Integer ipiv[size(A, 1)];
  external "FORTRAN 77" dgesv(size(A, 1), 1, Awork, size(A, 1), ipiv, x, size(A, 1), info);
  end solve;
  function solveAll
    input Real A[:, size(A, 1)];
    input Real B[size(A, 1), :];
    output Real X[size(A, 1), size(B, 2)] = B;
    output Integer info;
  protected
    Real Awork[size(A, 1), size(A, 1)] = A;
    Integer ipiv[size(A, 1)];
  external "FORTRAN 77" dgesv(size(A, 1), size(B, 2), Awork, size(A, 1), ipiv, X, size(A, 1), info);
  end solveAll;
  model Run
    parameter Real p = 0;
    Real x[2] = solve({{2, 1}, {1, 3 + time}}, {3, 5});
    Real y[3] = solve({{p, 2, 0}, {3, 0, 0}, {0, 1, 4}}, {2, 3*time, 9});
    Real z(start = 1, fixed = true);
    Real inverse[2, 2];
    Integer info;
    Integer singular;
    Real none[2];
  equation
    // 2 u + v = z, u + 3 v = z: u = 2 z/5
    der(z) = -2.5*(solve({{2, 1}, {1, 3}}, {z, z})*{1, 0});
    (inverse, info) = solveAll({{2, time}, {0, 4}}, identity(2));
    (none, singular) = solve({{1, 1}, {1, 1}}, {time, 2});
    // expect: x[1] @ 1 = 1
    // expect: x[2] @ 1 = 1
    // expect: y[1] @ 1 = 1
    // expect: y[2] @ 1 = 1
    // expect: y[3] @ 1 = 2
    // expect: z @ 1 = exp(-1)
    // expect: inverse[1,2] @ 1 = -0.125
    // expect: info @ 1 = 0
    // expect: singular @ 1 = 2
  end Run;
end P;
