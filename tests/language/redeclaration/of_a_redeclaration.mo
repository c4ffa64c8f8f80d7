// What is redeclared twice keeps the modifiers of the constraining clause of the first redeclaration.
model Run
  partial model Part
    parameter Real nominal;
    parameter Real other = 1;
    Real y;
  end Part;
  model Linear
    extends Part;
  equation
    y = nominal*time + other;
  end Linear;
  model Square
    extends Part;
    parameter Real p = 1;
  equation
    y = p*nominal*time^2 + other;
  end Square;
  model Base
    replaceable Linear part(nominal = 1) constrainedby Part(other = 5);
  end Base;
  model Valve
    parameter Real size = 3;
    extends Base(redeclare replaceable Linear part constrainedby Part(nominal = size));
  end Valve;
  model Special
    extends Valve(redeclare Square part(p = 2));
  end Special;
  Special special(size = 4);
  // expect: special.part.y @ 1 = 13
end Run;
