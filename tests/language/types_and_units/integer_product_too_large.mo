// run error: the Integer `p*p` is beyond 2^53, from where on Integers are not exact
model Run
  parameter Integer p = 94906267;
  Integer a = mod(p*p, 1000);
end Run;
