operator record C
  Real re;
  encapsulated operator function '+'
    import C;
    input C a;
    input C b;
    output C c = C(a.re + b.re);
  end '+';
end C;
model Run
  C a = C(time);
  C b = a + true; // error E0204: the record declares no '+' for these operands
end Run;
