// A subscript that leaves its array ends the run, with the name of the array.
model Run
  parameter Real tab[3] = {1, 2, 3};
  Integer k(start = 1, fixed = true);
  Real y = tab[k];
equation
  when sample(0.2, 0.2) then
    k = pre(k) + 1;
  end when;
  // run error: tab[k]
end Run;
