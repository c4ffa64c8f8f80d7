// A function whose derivative is known from other arguments: the author says that their rates are not needed, and the second component of
// `u` is not an unknown of the equation of the position, but one of its derivative.
package P
  function position
    input Real u[3];
    input Real dummy;
    output Real s;
  algorithm
    s := u[1];
    annotation (derivative(noDerivative = u) = position_der);
  end position;
  function position_der
    input Real u[3];
    input Real dummy;
    input Real dummy_der;
    output Real v;
  algorithm
    v := u[2];
    annotation (derivative(noDerivative = u, order = 2) = position_der2);
  end position_der;
  function position_der2
    input Real u[3];
    input Real dummy;
    input Real dummy_der;
    input Real dummy_der2;
    output Real a;
  algorithm
    a := u[3];
  end position_der2;
  model Run
    Real s(start = 0, fixed = true);
    Real v(start = 0, fixed = true);
    Real a;
    Real other_s;
    Real other_v;
    Real other_a;
    Real f;
  equation
    der(s) = v;
    der(v) = a;
    1*a = sin(time) - f;
    other_s = position({s, v, a}, time);
    der(other_s) = other_v;
    der(other_v) = other_a;
    3*other_a = f;
    // expect: v @ 1 = (1 - cos(1))/4
    // expect: other_s @ 1 = (1 - sin(1))/4
    // expect: f @ 1 = 3*sin(1)/4
  end Run;
end P;
