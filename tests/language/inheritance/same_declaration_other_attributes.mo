// Two bases declare the same variable with other bounds and start values: one variable, and a warning.
package P
  model A
    Real x(min = 0, start = 1);
  end A;
  model B
    Real x(start = 2, stateSelect = StateSelect.prefer); // warning E0205: `x` is declared twice with different attributes; those of the first count
  end B;
  model Run
    extends A;
    extends B;
  equation
    der(x) = -x;
    // expect: x @ 1 = exp(-1)
  end Run;
end P;
