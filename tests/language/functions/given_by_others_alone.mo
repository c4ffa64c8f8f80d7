// A derivative that leaves out the rate of an argument holds along solutions only: the slope by that argument, which Newton's method needs,
// is that of the function itself.
package P
  function cube
    input Real u[2];
    input Real dummy;
    output Real y;
  algorithm
    y := u[1]^3 + u[1];
    annotation (derivative(noDerivative = u) = cube_der);
  end cube;
  function cube_der
    input Real u[2];
    input Real dummy;
    input Real dummy_der;
    output Real y_der;
  algorithm
    y_der := (3*u[1]^2 + 1)*u[2];
  end cube_der;
  model Run
    Real x(start = 1);
    Real w(start = 0, fixed = true);
  equation
    2 + 8*time = cube({x, 0}, time);
    der(w) = x;
    // expect: x @ 1 = 2
    // expect: x @ 0 = 1
  end Run;
end P;
