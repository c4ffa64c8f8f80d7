// Strings that a loop chooses are given to a function of Strings.
model Run
  package Air
    constant Integer count = 3;
    constant String names[:] = {"nitrogen", "Water", "argon"};
  end Air;
  package Nothing
    constant Integer count = 0;
    constant String names[:] = {"Water"};
  end Nothing;
  function is_equal
    input String a;
    input String b;
    output Boolean y;
  algorithm
    y := a == b;
  end is_equal;
  final parameter Real s[Air.count] = {if is_equal(a = Air.names[i], b = "Water") then 1 else 0 for i in 1:Air.count};
  final parameter Real none[Nothing.count] = {if is_equal(Nothing.names[i], "Water") then 1 else 0 for i in 1:Nothing.count};
  Real x[3] = s*time;
  // expect: x[1] @ 1 = 0
  // expect: x[2] @ 1 = 1
  // expect: x[3] @ 1 = 0
end Run;
