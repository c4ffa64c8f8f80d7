// The value of an output may be declared by a variable further down; results come in the order of the declarations all the same.
package P
  function f
    input Real a[:];
    output Real longer[n + 1] = cat(1, a, zeros(1));
    output Integer count;
  protected
    Integer n = size(a, 1);
  algorithm
    count := n;
  end f;
  function first
    input Real a[:];
    output Integer k;
  protected
    Real all[size(a, 1) + 1];
    Integer count;
  algorithm
    (all, count) := f(a);
    k := integer(all[2]) + 10*count;
  end first;
  model Run
    Real x[first({1, 2, 3})] = fill(time, first({1, 2, 3}));
    // expect: x[32] @ 1 = 1
  end Run;
end P;
