model Run
  Real y;
algorithm
  y := time;
  terminate("no"); // error E0216: `terminate` is allowed only inside `when`
end Run;
