// An algorithm section assigns elements at subscripts that change during the run, of vectors and matrices, also as a row.
model Run
  Integer k(start = 0, fixed = true);
  Real a[4](each start = 0, each fixed = true);
  Integer m[2, 3](each start = 0, each fixed = true);
  Real rows[3, 2](each start = 0, each fixed = true);
  Real last;
algorithm
  when sample(0, 0.25) then
    k := pre(k) + 1;
    if k <= 4 then
      a[k] := 10*time + 1;
      a[max(k - 1, 1)] := a[k] + a[max(k - 1, 1)];
    end if;
    m[mod(k, 2) + 1, mod(k, 3) + 1] := k;
    rows[mod(k, 3) + 1, :] := {k, -k};
  end when;
equation
  last = a[min(k, 4)];
  // at 0, 0.25, 0.5, 0.75: 1 doubled, then 3.5 added; 6 added to 3.5; 8.5 added to 6
  // expect: a[1] @ 0.9 = 2 + 3.5
  // expect: a[2] @ 0.9 = 3.5 + 6
  // expect: a[3] @ 0.9 = 6 + 8.5
  // expect: a[4] @ 0.9 = 8.5
  // expect: last @ 0.3 = 3.5
  // k = 1, 2, 3, 4 at [2, 2], [1, 3], [2, 1], [1, 2]
  // expect: m[2,2] @ 0.9 = 1
  // expect: m[1,3] @ 0.9 = 2
  // expect: m[2,1] @ 0.9 = 3
  // expect: m[1,2] @ 0.9 = 4
  // expect: m[1,1] @ 0.9 = 0
  // expect: rows[2,2] @ 0.9 = -4
  // expect: rows[3,1] @ 0.9 = 2
end Run;
