// Numbers that vary are equal at single instants at most; as a guard of a quotient their equality does no harm.
model Run
  Real h(start = 0, fixed = true);
  Real y;
  Integer n(start = 0, fixed = true);
  Integer m(start = 0, fixed = true);
  Real level = if time >= 0.5 then 2 else 1 "constant between events";
  Integer reached(start = 0, fixed = true);
  Boolean both = (time > 0.2) == (time > 0.4);
equation
  der(h) = 1;
  y = if h == 0 then 1 else sin(h)/h;
  when h == 0.5 then // warning W0403: numbers that vary continuously are compared for equality: no event is found where they are equal
    n = pre(n) + 1;
  end when;
  when n == 1 then
    m = 1;
  end when;
  when level == 2 then
    reached = 1;
  end when;
end Run;
