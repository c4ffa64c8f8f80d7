// Lags at rest: at the start the sides of their relations are equal but for roundings, which differ from pass to pass.
model Run
  parameter Integer n = 40;
  parameter Real K[n] = {200 + 3.7*i for i in 1:n};
  parameter Real u0[n] = {0.1 + sin(i)/20 for i in 1:n};
  Real u[n](start = u0);
  Real state[n];
  Real y[n];
equation
  for i in 1:n loop
    exp(u[i]) + 0.3*sum(u) + u[i]^3 = exp(u0[i]) + 0.3*sum(u0) + u0[i]^3 + 1e-30*time;
    0.1*der(state[i]) = K[i]*u[i] - state[i];
    when state[i] > 1000 and K[i]*u[i] - state[i] < 0 then
      reinit(state[i], 1000);
    elsewhen state[i] < -1000 and K[i]*u[i] - state[i] > 0 then
      reinit(state[i], -1000);
    end when;
    y[i] = max(min(state[i], 1000), -1000);
  end for;
initial equation
  state = K .* u0;
  // expect: y[1] @ 0.1 = 203.7*(0.1 + sin(1)/20) rel 1e-5
  // stop: 0.1
end Run;
