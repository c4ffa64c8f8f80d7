// A redeclaration that does not say `parameter` leaves it as it was declared.
model Run
  record R
    parameter Real a = 1;
    Real b = 2;
  end R;
  record S
    extends R(a = 5);
  end S;
  model M
    replaceable parameter R r;
    final parameter Real q = r.a + r.b;
    Real x = q*time;
  end M;
  M m(redeclare S r);
  // expect: m.x @ 1 = 7
end Run;
