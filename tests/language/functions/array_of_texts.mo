// Texts as an array are an input like others; a function that only checks them is called for it.
package Fluid
  constant String names[:] = {"water", "air"};
  constant String none[:] = fill("", 0);
end Fluid;
function amount
  input String first;
  input String all[:];
  input Real parts[size(all, 1)];
  output Real y;
algorithm
  y := size(all, 1);
  for i in 1:size(all, 1) loop
    if all[i] == first then
      y := y + parts[i];
    end if;
  end for;
end amount;
function check
  input String all[:];
  input Real parts[:];
algorithm
  for i in 1:size(all, 1) loop
    assert(parts[i] > 0, "no " + all[i]);
  end for;
end check;
model Run
  parameter Real parts[2] = {0.25, 0.5};
  Real x = amount("air", Fluid.names, parts);
  Real y = amount("air", Fluid.none, fill(0, 0));
equation
  check(Fluid.names, parts);
  // expect: x @ 1 = 2.5
  // expect: y @ 1 = 0
end Run;
