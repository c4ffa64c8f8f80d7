model E10 "when with elsewhen priority, pre in equations, reinit in array loop"
  parameter Integer n = 3;
  Real x[n](start={0.1,0.2,0.3}, each fixed=true);
  Integer hits[n](each start=0, each fixed=true);
equation
  for i in 1:n loop
    der(x[i]) = 1;
    when x[i] >= 0.5 then
      reinit(x[i], 0);
      hits[i] = pre(hits[i]) + 1;
    end when;
  end for;
  // expect: hits[1] @ 1 = 2
  // expect: hits[3] @ 1 = 2
  // expect: x[1] @ 1 = 0.1
  // expect: x[3] @ 1 = 0.3
end E10;
