// An assertion in a branch counts only while the branch holds.
model IfAssert
  Real x = time;
  Real y;
equation
  if x > 0.5 then
    assert(x < 2, "x over 2");
    y = 1;
  else
    y = 0;
  end if;
  // expect: y @ 1 = 1
end IfAssert;
