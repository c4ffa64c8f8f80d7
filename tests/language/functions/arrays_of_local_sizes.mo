// `identity`, `linspace` and enumerations as sizes inside functions, run symbolically and compiled.
type E = enumeration(a, b);
function unit_times
  input Real A[:, :];
  output Real B[size(A, 1), size(A, 2)];
algorithm
  B := identity(size(A, 1));
  B := B*A + 2*identity(size(A, 1));
end unit_times;
function spaced
  input Real a;
  output Real y;
protected
  Real w = 1;
algorithm
  while w < a + 3 loop
    w := w + 1;
  end while;
  y := w + sum(linspace(a, 3, 4)) + linspace(a, 3, 5)*identity(5)*linspace(0, 1, 5);
end spaced;
function of_literal
  input E e;
  input Boolean second = false;
  output Real v;
protected
  Real t[E] = {1.5, 2.5};
  Real u[Boolean] = {10, 20};
algorithm
  v := t[e] + t[E.b] + u[second];
end of_literal;
model Run
  Real y[2, 2] = unit_times([1, 2; 3, time]);
  Real z = spaced(time);
  E s(start = E.a, fixed = true);
  Real v = of_literal(s);
  Real w = of_literal(E.b, time > 0.7);
  parameter Integer n = integer(of_literal(E.a, true));
  Real sized[n];
equation
  when time > 0.5 then
    s = E.b;
  end when;
  for i in 1:n loop
    sized[i] = i*time;
  end for;
  // expect: y[1,1] @ 1 = 3
  // expect: y[1,2] @ 1 = 2
  // expect: y[2,2] @ 1 = 3
  // expect: z @ 1 = 4 + 8 + 1.5*0.25 + 2*0.5 + 2.5*0.75 + 3
  // expect: v @ 0.25 = 14
  // expect: v @ 1 = 15
  // expect: w @ 1 = 25
  // expect: sized[24] @ 1 = 24
  // absent: sized[25]
end Run;
