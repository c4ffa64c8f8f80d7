// A condition on a parameter found at the start is decided by the start, not by the guess of the parameter.
model M
  parameter Real k(fixed = false, start = 1);
  parameter Real m = 2*k;
  Real x(start = 1, fixed = true);
  Real a, b[2], w(start = 0, fixed = true);
initial equation
  k^2 = 4;
equation
  if k > 1.5 then
    der(x) = -x;
  else
    der(x) = x;
  end if;
  if k > 5 then
    a = 1;
  elseif m > 3 then
    a = 2;
  else
    a = 3;
  end if;
  for i in 1:2 loop
    if m > 3 then
      b[i] = i;
    else
      b[i] = -i;
    end if;
  end for;
  der(w) = 0;
  when time > 0.5 then
    if k > 1.5 then
      reinit(w, 1);
    end if;
  end when;
  // expect: x @ 1 = exp(-1)
  // expect: a @ 0 = 2
  // expect: b[2] @ 0 = 2
  // expect: w @ 1 = 1
end M;
