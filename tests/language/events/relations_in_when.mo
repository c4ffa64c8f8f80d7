// What stands in a `when` is evaluated at its events: relations there make none, so `u < pre(u)`, whose sides are equal between events, does
// not chatter.
model Run
  Real u = 1 - cos(5*time);
  discrete Real s(start = 1, fixed = true);
  Real r(start = 1, fixed = true);
  Integer late(start = 0, fixed = true), hits(start = 0, fixed = true);
equation
  when sample(0.1, 0.1) then
    s = if u < pre(u) then -pre(s) else pre(s);
    // At the instants of the sampler themselves, which are no exact decimals.
    late = pre(late) + (if time >= 0.3 then 1 else 0);
  end when;
  when u > 0.4 then
    // The relation that fires is true where it fires.
    hits = pre(hits) + (if u > 0.4 then 1 else 100);
  end when;
algorithm
  when sample(0.1, 0.1) then
    if time > 0.15 and u < pre(u) then
      r := -pre(r);
    end if;
  end when;
  // expect: s @ 1 = 1
  // expect: r @ 1 = 1
  // expect: late @ 0.35 = 1
  // expect: late @ 0.95 = 7
  // expect: hits @ 1 = 1
end Run;
