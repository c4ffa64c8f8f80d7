model Run
  constant Integer c = 94906267;
  Integer b = mod(c*c, 1000); // error E0217: the Integer `c*c` is beyond 2^53, from where on Integers are not exact
  Integer d = 9007199254740993; // error E0204: the value of `d` is Real, but `d` is Integer
  Real x = 9007199254740993;
end Run;
