// Operators that a record declares have values before the run, too.
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
  function twice
    input D x;
    output D y;
  algorithm
    y := x + x;
  end twice;
end P;
model Run
  constant P.D j = P.D(0, 1);
  constant P.D a = 0.5*j + P.D(1, 0);
  parameter P.D b = a*j;
  constant P.D minus = -a, difference = 3 - a;
  constant P.D list[:] = fill(0.5*j, 2);
  constant P.D product = {j, a}*{a, j};
  constant P.D elements[2] = j*list, dotted[2] = list .* {a, j};
  constant Integer n = if a*j == j*a then 3 else 2;
  constant P.D again = P.twice(a);
  Real v[n] = {k*time for k in 1:n};
  Real x = time*(a.b + b.b);
  // expect: x @ 1 = 1.5
  // expect: minus.b @ 0 = -0.5
  // expect: difference.a @ 0 = 2
  // expect: difference.b @ 0 = -0.5
  // expect: list[2].b @ 0 = 0.5
  // expect: product.a @ 0 = -1
  // expect: product.b @ 0 = 2
  // expect: elements[2].a @ 0 = -0.5
  // expect: dotted[1].b @ 0 = 0.5
  // expect: dotted[2].a @ 0 = -0.5
  // expect: again.b @ 0 = 1
  // expect: v[3] @ 1 = 3
end Run;
