// An operator without a function for its operands.
package P
  operator record D
    Real a;
    encapsulated operator function '*'
      import P.D;
      input Real n;
      input D d;
      output D r;
    algorithm
      r := D(a = n*d.a);
    end '*';
  end D;
end P;
model Run
  constant P.D one(a = 1);
  constant P.D two = 2*one;
  constant P.D wrong = one*2; // error E0204: the record declares no '*' for these operands
  Real y = time*two.a*wrong.a;
end Run;
