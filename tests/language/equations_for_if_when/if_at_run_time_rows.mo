// Branches that say the same in other words: arrays, loops, records, another order.
model RunIf "run-time if with arrays, for, records, different order"
  record Q
    Real a; Real b;
  end Q;
  Real x[3]; Real y; Real z; Q q;
  Boolean late = time > 0.5;
equation
  if late then
    x = {1, 2, 3};
    y = 1;
    z = 2;
    q = Q(1, 2);
  else
    for i in 1:3 loop
      x[i] = -i;
    end for;
    z = 20;
    y = 10;
    q.b = 5;
    q.a = 7;
  end if;
  // expect: x[2] @ 0.2 = -2
  // expect: x[3] @ 1 = 3
  // expect: y @ 0 = 10
  // expect: y @ 1 = 1
  // expect: q.b @ 0.3 = 5
  // expect: q.b @ 0.9 = 2
end RunIf;
