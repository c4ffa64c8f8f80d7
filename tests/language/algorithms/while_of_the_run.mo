// Loops that only the run decides.
model AlgoWhile
  Real y(start = 0);
  Integer n;
  Real x;
algorithm
  x := 1 + time;
  n := 0;
  while x > 0.1 loop
    x := x/2;
    n := n + 1;
    if n > 3 then
      break;
    end if;
  end while;
  y := x;
  // expect: y @ 1 = 0.125
  // expect: n @ 1 = 4
end AlgoWhile;
