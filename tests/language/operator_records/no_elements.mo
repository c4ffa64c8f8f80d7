// Products and sums of operator records without elements are what the functions of the record say.
package P
  operator record D
    Real a;
    Real b = 0;
    encapsulated operator 'constructor'
      function from_number
        import P.D;
        input Real a;
        input Real b = 0;
        output D d(a = a, b = b);
      algorithm
      end from_number;
    end 'constructor';
    encapsulated operator function '+'
      import P.D;
      input D x;
      input D y;
      output D r;
    algorithm
      r := D(x.a + y.a, x.b + y.b);
    end '+';
    encapsulated operator '-'
      function negate
        import P.D;
        input D x;
        output D r;
      algorithm
        r := D(-x.a, -x.b);
      end negate;
      function subtract
        import P.D;
        input D x;
        input D y;
        output D r;
      algorithm
        r := D(x.a - y.a, x.b - y.b);
      end subtract;
    end '-';
    encapsulated operator '*'
      function multiply
        import P.D;
        input D x;
        input D y;
        output D r;
      algorithm
        r := D(x.a*y.a - x.b*y.b, x.a*y.b + x.b*y.a);
      end multiply;
      function scalar_product
        import P.D;
        input D x[:];
        input D y[size(x, 1)];
        output D r;
      algorithm
        r := D(0);
        for k in 1:size(x, 1) loop
          r := r + x[k]*y[k];
        end for;
      end scalar_product;
    end '*';
    encapsulated operator function '=='
      import P.D;
      input D x;
      input D y;
      output Boolean r;
    algorithm
      r := x.a == y.a and x.b == y.b;
    end '==';
  end D;
end P;
model Run
  constant P.D none[0] = fill(P.D(1), 0);
  constant P.D p = none*none;
  constant P.D q = fill(P.D(1), 0)*none[:] + 1;
  parameter P.D r[0];
  parameter P.D t = r*r;
  constant P.D negated[:] = -none;
  Real x = p.a + q.a + t.a;
  Real y = size(negated, 1);
  // expect: x @ 0 = 1
  // expect: y @ 0 = 0
end Run;
