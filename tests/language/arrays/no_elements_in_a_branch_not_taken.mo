// A branch that sizes rule out may name elements that do not exist.
model Table
  parameter Real t[:, :] = fill(0.0, 0, 2);
  parameter Real k = if size(t, 1) > 0 then t[1, 2] else 3;
  Real y = if size(t, 1) > 0 then t[1, 1]*time else 4;
  Real z;
  Real w;
equation
  if size(t, 1) >= 1 then
    z = t[1, 2];
  else
    z = 5;
  end if;
algorithm
  if size(t, 1) == 0 then
    w := 6;
  else
    w := t[1, 1];
  end if;
end Table;
model Run
  Table none;
  Table some(t = [7, 8]);
  // expect: none.k @ 0 = 3
  // expect: none.y @ 1 = 4
  // expect: none.z @ 1 = 5
  // expect: none.w @ 1 = 6
  // expect: some.k @ 0 = 8
  // expect: some.y @ 1 = 7
  // expect: some.z @ 1 = 8
  // expect: some.w @ 1 = 7
end Run;
