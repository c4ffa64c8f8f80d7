// run error: the Integer `y*k` is beyond 2^53, from where on Integers are not exact
model Run
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
  parameter Integer n = 20;
  Integer f = mod(fac(n), 1000);
end Run;
