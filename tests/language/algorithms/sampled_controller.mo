// A sampled controller with limits, as a plant engineer writes it.
model AlgoDiscrete "typical discrete controller"
  parameter Real Ts = 0.1, k = 2, Ti = 0.5;
  Real x(start = 0, fixed = true);
  discrete Real u(start = 0, fixed = true), I(start = 0, fixed = true), e;
  Integer count(start=0, fixed=true);
equation
  der(x) = -x + u;
algorithm
  when sample(0, Ts) then
    e := 1 - x;
    I := pre(I) + Ts/Ti*e;
    u := k*(e + I);
    if u > 1.5 then
      u := 1.5;
    elseif u < -1.5 then
      u := -1.5;
    end if;
    count := pre(count) + 1;
  end when;
  // expect: u @ 0.05 = 1.5
  // expect: count @ 0.95 = 10
end AlgoDiscrete;
