model Run
  Real y;
  // error E0216: `return` and `break` end a function or a loop, not an algorithm section
algorithm
  y := 1;
  if time > 0.5 then
    return;
  end if;
  y := 2;
end Run;
