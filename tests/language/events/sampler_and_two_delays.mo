// What delays give back coincides with instants of the sampler; no instant is lost.
model M
  discrete Real u(start = 0, fixed = true);
  Integer n(start = 0, fixed = true);
  Real d(start = 0) = delay(u, 0.1) + delay(u, 0.2);
  Real chain = delay(delay(u, 0.1), 0.2) - delay(u, 0.3);
equation
  when sample(0.1, 0.1) then
    n = pre(n) + 1;
    u = if mod(n, 3) == 0 then 1 else 0;
  end when;
  // stop: 100
  // expect: n @ 99.85 = 998
  // expect: n @ 100 = 1000
  // note: u is 1 from 0.3 k to 0.3 k + 0.1, so d is 1 but from 0.3 k to 0.3 k + 0.1
  // expect: d @ 89.2 = 1
  // expect: d @ 90.2 = 1
  // expect: d @ 90 = 0
  // expect: chain @ 90 = 0
  // expect: chain @ 95.2 = 0
end M;
