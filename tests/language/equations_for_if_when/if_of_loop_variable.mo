// A condition of the loop variable is decided per turn, so the other branch may name what does not exist.
model IfFor "structural if in for, with boundary"
  parameter Integer n = 5;
  Real T[n](each start = 0, each fixed = true);
equation
  for i in 1:n loop
    if i == 1 then
      der(T[i]) = 1 - T[i];
    elseif i == n then
      der(T[i]) = T[i-1] - 2*T[i];
    else
      der(T[i]) = T[i-1] - T[i];
    end if;
  end for;
  // stop: 50
  // expect: T[1] @ 50 = 1
  // expect: T[5] @ 50 = 0.5
end IfFor;
