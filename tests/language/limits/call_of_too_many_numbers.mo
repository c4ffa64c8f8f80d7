// Each result of a compiled function is an equation of all arguments: too many of both would take the memory of the machine.
package P
  function running
    input Real u[:];
    output Real y[size(u, 1)];
  protected
    Integer k = 1;
  algorithm
    y := u;
    while k < size(u, 1) and u[1] < 10 loop
      k := k + 1;
      y[k] := y[k - 1] + u[k];
    end while;
  end running;
  model Run
    discrete Real u[1100](each start = 0, each fixed = true);
    discrete Real y[1100](each start = 0, each fixed = true);
  algorithm
    when sample(0, 0.5) then
      y := running(u); // error E0103: `running` gives 1100 numbers from 1100: each would be an equation of all of them, more than 1048576 operands
    end when;
  end Run;
end P;
