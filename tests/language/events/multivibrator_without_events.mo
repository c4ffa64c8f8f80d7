// An amplifier with positive feedback, limited without an event: its solution ends at a corner, and the run goes on with the one at the other
// limit.  Half a period is R C ln(1 + 2 R1/R2) = ln 3 of the time constant.
model Run
  parameter Real gain = 15000;
  parameter Real T = 0.1;
  Real out(start = 10);
  Real v(start = 0, fixed = true);
  Real between = out/2 - v;
equation
  out = smooth(0, noEvent(if gain*between > 10 then 10 else if gain*between < -10 then -10 else gain*between));
  T*der(v) = out - v;
end Run;
// From 0 to 5 it takes T ln 2 = 0.0693 s, then T ln 3 = 0.1099 s each.
// expect: out @ 0.06 = 10
// expect: out @ 0.1 = -10
// expect: out @ 0.17 = -10
// expect: out @ 0.2 = 10
// It turns where gain*between is 10, 1/1500 before 5: v = 10 - (15 - 1/1500) exp(-(0.2 - 0.1791484)/T).
// expect: v @ 0.2 = -2.175846 abs 1e-4
// stop: 1
