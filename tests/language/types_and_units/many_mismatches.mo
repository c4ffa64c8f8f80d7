model D06
  type E = enumeration(a, b);
  // error E0201: `D06.E` has no literal `c`
  E e = E.c;
  // error E0204: the value of `b` is Integer, but `b` is Boolean
  Boolean b = 1;
  // error E0204: this operator needs a Real or Integer, but this is Boolean
  Real r = true + 1;
  // error E0204: a condition needs a Boolean, but this is Integer
  Real q = if 1 then 2 else 3;
  // error E0204: the value of `k` is Real, but `k` is Integer
  Integer k = time;
  // error E0207: the value of `s` has the wrong size: [1, 2] instead of [2]
  Real s[2] = [1, 2];
end D06;
