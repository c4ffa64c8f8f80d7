// Each level of a class that inherits from the one around it is redeclared in the next, until one is not.
package Lib
  model Leaf
    Real y = 1;
  end Leaf;
  partial model Any
  end Any;
  model Base
    replaceable model Child = Leaf constrainedby Any;
    Child c;
    model Nest
      extends Base;
    end Nest;
  end Base;
end Lib;
model Run
  Lib.Base b(redeclare model Child = Lib.Base.Nest(
    redeclare model Child = Lib.Base.Nest.Nest(redeclare model Child = Lib.Base.Nest.Nest.Nest)));
  // expect: b.c.c.c.c.y @ 1 = 1
end Run;
