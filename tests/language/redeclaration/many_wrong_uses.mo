model D07
  partial model P
    Real x;
  end P;
  model Q
    Real y = 1;
  end Q;
  model H
    replaceable Q q constrainedby Q;
    Q fixed_q;
    final parameter Real z = 1;
  end H;
  model R
    Real w = 1;
  end R;
  // error E0210: `D07.R` has no element `y`, which `D07.Q` has
  H h1(redeclare R q);
  // error E0210: `fixed_q` is redeclared but was not declared `replaceable`
  H h2(redeclare Q fixed_q);
  // error E0209: `z` is final and cannot be modified
  H h3(z = 2);
  // error E0212: `D07.P` is partial and cannot be the class of a component
  P p;
  // error E0201: no enclosing model declares `inner nope`
  outer Real nope;
end D07;
