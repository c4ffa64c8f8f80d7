// An `extends` clause redeclares by classes of the heir, which stand further down and are redeclared for a component themselves.
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
  partial function Shape
    input Real x;
    output Real y;
  end Shape;
  function plain
    extends Shape;
  algorithm
    y := x;
  end plain;
  function twice
    extends Shape;
  algorithm
    y := 2*x;
  end twice;
  partial model Base
    replaceable package Medium = Water;
    replaceable function shape = plain constrainedby Shape;
    Real y = Medium.f(time);
    Real z = shape(time);
  end Base;
  model Sensor
    extends Base(redeclare package Medium = Own, redeclare function shape = own_shape);
    replaceable package Own = Water;
    replaceable function own_shape = plain constrainedby Shape;
  end Sensor;
  model Run
    Sensor s(redeclare package Own = Oil, redeclare function own_shape = twice);
    // expect: s.y @ 1 = 3
    // expect: s.z @ 1 = 2
  end Run;
end P;
