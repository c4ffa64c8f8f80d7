// The value that a short definition gives an input is looked up where the definition stands (7.2.1), before the run and in it.
package P
  constant Real c = 2;
  function scaled
    input Real u;
    input Real c = 1; // warning W0202: `c` hides the constant `c`
    output Real y = c*u;
  end scaled;
  function twice = scaled(c = c);
  model Run
    parameter Integer n = integer(twice(3));
    Real x[n] = fill(twice(time), n);
    // expect: x[6] @ 1 = 2
  end Run;
end P;
