// A branch that is not taken is not evaluated, also where a jump inside it needs an equation of its own.
model M
  Real n = time - 0.5;
  Real b = if n > 0.1 then floor(10*sqrt(n)) else 0;
  Real c = if n > 0.1 then (if n > 0.2 then integer(sqrt(n - 0.2)*10) else -1) else -2;
  Real d = if n < -0.1 then 7 elseif n > 0.1 then ceil(1/n) else 0;
  Real e = if n > 0.1 then mod(1, sqrt(n)) else 0;
  Real f = if n > 0.1 then div(1, sqrt(n)) else 0;
  Real g = if n > 0.1 then rem(1, log(1 + n)) else 0;
  Real h = noEvent(if n > 0.1 then floor(10*sqrt(n)) else 0);
  Boolean i = n > 0.1 and floor(10*sqrt(n)) > 5;
  Boolean j = not n > 0.1 or floor(10*sqrt(n)) > 5;
  Real k;
  Real l;
  Integer m(start = 0, fixed = true);
equation
  if n > 0.1 then
    k = floor(10*sqrt(n));
  else
    k = 0;
  end if;
  when n > 0.1 and sqrt(n) > 0.5 then
    m = pre(m) + 1;
  end when;
algorithm
  l := 0;
  if n > 0.1 then
    l := floor(10*sqrt(n));
  end if;
equation
  // note: n is 0.5 at 1, 10*sqrt(n) 7.07; at 0.7 it is 0.2 and 4.47
  // expect: b @ 1 = 7
  // expect: b @ 0.7 = 4
  // expect: b @ 0.4 = 0
  // expect: c @ 1 = 5
  // expect: c @ 0.66 = -1
  // expect: c @ 0.4 = -2
  // expect: d @ 0.9 = 3
  // expect: d @ 0.8 = 4
  // expect: d @ 0.2 = 7
  // expect: e @ 1 = 1 - sqrt(0.5)
  // expect: f @ 1 = 1
  // expect: f @ 0.7 = 2
  // expect: g @ 1 = 1 - 2*log(1.5)
  // expect: h @ 1 = 7
  // expect: i @ 1 = 1
  // expect: i @ 0.7 = 0
  // expect: j @ 0.2 = 1
  // expect: j @ 0.7 = 0
  // expect: j @ 1 = 1
  // expect: k @ 1 = 7
  // expect: k @ 0.4 = 0
  // expect: l @ 1 = 7
  // expect: l @ 0.4 = 0
  // expect: m @ 1 = 1
end M;
