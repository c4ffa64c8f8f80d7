model D05
  // error E0101: expected `,`, `)` or an operator, found `fixed`
  Real x(start = 1 fixed = true);
equation
  // error E0101: expected `;` after this equation, found `when`
  der(x) = -x
  when x < 0.5 then
    reinit(x, 1);
  end when;
end D05;
