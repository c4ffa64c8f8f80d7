// A subscript of the run that leaves its array ends the run.
model Run
  Integer k(start = 0, fixed = true);
  Real a[2](each start = 0, each fixed = true);
algorithm
  when sample(0, 0.25) then
    k := pre(k) + 1;
    a[k] := time;
  end when;
  // run error: the subscript `k` is outside 1..2
end Run;
