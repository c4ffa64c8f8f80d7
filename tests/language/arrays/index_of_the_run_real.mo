model Run
  parameter Real tab[3] = {1, 2, 3};
  Real k = 1 + time;
  Real y = tab[k]; // error E0204: an Integer is needed here, not Real
end Run;
