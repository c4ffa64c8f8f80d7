// Elements of arrays of constants at positions that the run decides, in one and in two dimensions.
package P
  constant Real list[40] = {0.5, 1.5, 4.5, 9.5, 16.5, 25.5, 36.5, 49.5, 64.5, 81.5, 3.5, 24.5, 47.5, 72.5, 2.5, 31.5, 62.5, 95.5, 33.5, 70.5, 12.5, 53.5, 96.5, 44.5, 91.5, 43.5, 94.5, 50.5, 8.5, 65.5, 27.5, 88.5, 54.5, 22.5, 89.5, 61.5, 35.5, 11.5, 86.5, 66.5};
  constant Real rows[10, 2] = {{1, 1}, {2, 4}, {3, 9}, {4, 16}, {5, 25}, {6, 36}, {7, 49}, {8, 64}, {9, 81}, {10, 100}};
  function at
    input Real t;
    output Real y;
    output Real z;
  protected
    constant Real own[:] = list;
    Integer k;
    Real row[2];
  algorithm
    k := 1;
    while k < t loop
      k := k + 1;
    end while;
    y := own[k];
    k := min(k, 10);
    row := rows[k, :];
    z := row[1] + row[2];
  end at;
  model Run
    Real y;
    Real z;
  equation
    (y, z) = at(39.5*time);
    // expect: y @ 1 = 66.5
    // expect: y @ 0.5 = 70.5
    // expect: z @ 1 = 110
    // expect: z @ 0.1 = 20
  end Run;
end P;
