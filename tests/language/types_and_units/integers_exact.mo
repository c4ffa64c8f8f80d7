// Integers of the run are exact or end in an error.
model Run
  Integer a(start = 3, fixed = true);
  Integer b(start = 1, fixed = true);
  parameter Integer p = 3;
  Integer q = p*p + 2*p - 1;
  Integer f = fac(5);
  function fac
    input Integer n;
    output Integer y = 1;
  protected
    Integer k = n;
  algorithm
    while k > 1 loop
      y := y*k;
      k := k - 1;
    end while;
  end fac;
  Integer s(start = 42, fixed = true);
  Integer big = 94906265*p;
equation
  when sample(0.1, 0.1) then
    a = 2*pre(a);
    b = pre(b) + pre(a);
    s = mod(16807*pre(s), 2147483647);
  end when;
  // expect: a @ 0.95 = 3*2^9
  // expect: b @ 0.95 = 1 + 3*(2^9 - 1)
  // expect: q @ 1 = 14
  // expect: f @ 1 = 120
  // expect: big @ 1 = 284718795
  // expect: s @ 0.95 = 1139130650
end Run;
