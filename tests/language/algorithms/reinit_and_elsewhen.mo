// `reinit` and `terminate` in an algorithm.
model AlgoWhenReinit
  Real x(start=1, fixed=true);
  Real v(start=0, fixed=true);
  Integer n(start=0, fixed=true);
equation
  der(x) = v;
  der(v) = -9.81;
algorithm
  when x <= 0 then
    n := pre(n) + 1;
    reinit(v, -0.8*v);
  elsewhen n >= 100 then
    terminate("enough");
  end when;
  // expect: n @ 1 = 1
end AlgoWhenReinit;
