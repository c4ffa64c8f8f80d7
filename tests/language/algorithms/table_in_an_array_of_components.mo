// A constant table at subscripts of the run, in every element of an array of components.
model Run
  type L = enumeration(a, b, c);
  block Part
    input L x;
    Integer n;
    constant Integer table[L, L] = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
  algorithm
    n := table[L.b, x];
  end Part;
  Part part[2](x = {if time > 0.5 then L.b else L.a, L.c});
  // expect: part[1].n @ 0.2 = 3
  // expect: part[1].n @ 1 = 4
  // expect: part[2].n @ 1 = 5
end Run;
