// The modification of a short definition belongs to what is around it (Modelica 3.6, section 4.5.1): `Medium = Medium` names the
// package around, which may have been redeclared for the component, and values are those of the component.
package P
  partial package Water
    constant Real k = 1;
    replaceable partial function f
      input Real x;
      output Real y;
    end f;
  end Water;
  package Oil
    extends Water(k = 3);
    redeclare function extends f
    algorithm
      y := k*x;
    end f;
  end Oil;
  function of_medium
    replaceable package Medium = Water;
    input Real x;
    output Real y;
  algorithm
    y := Medium.f(x) + Medium.k;
  end of_medium;
  partial model Base
    replaceable package Medium = Water;
    function g = of_medium(redeclare package Medium = Medium);
  end Base;
  model Sensor
    extends Base;
    Real y = g(time);
  end Sensor;
  partial model Element
    parameter Real V;
    parameter Real A = 2;
    Real x = V*time;
  end Element;
  model Plain
    extends Element;
  end Plain;
  model Other
    extends Element;
    parameter Real q = 1;
  end Other;
  model Exchanger
    replaceable model E = Plain(A = 4) constrainedby Element(final V = whole/n);
    parameter Integer n = 3;
    parameter Real whole = 6;
    E e[n];
  end Exchanger;
  model Run
    package Own = Oil(k = 5);
    parameter Real seven = 7;
    Sensor s(redeclare package Medium = Oil);
    Sensor several[2](redeclare package Medium = Own);
    Exchanger first;
    Exchanger second(n = 2, redeclare model E = Other(q = seven));
    // expect: s.y @ 1 = 6
    // expect: several[2].y @ 1 = 10
    // expect: first.e[3].x @ 1 = 2
    // expect: first.e[3].A @ 1 = 4
    // expect: second.e[2].x @ 1 = 3
    // expect: second.e[2].A @ 1 = 2
    // expect: second.e[2].q @ 1 = 7
  end Run;
end P;
