// Without a flow nothing says what it would bring along: the value at the start stays until there is one.
model Run
  Real m_flow = if time < 1 then 0 else 2;
  Real h(start = 2);
  Real brought = m_flow*h;
equation
  m_flow*(h - 3) = 0;
end Run;
// expect: h @ 0.5 = 2
// expect: brought @ 0.5 = 0 abs 1e-12
// expect: h @ 1.5 = 3
// expect: brought @ 1.5 = 6
// stop: 2
