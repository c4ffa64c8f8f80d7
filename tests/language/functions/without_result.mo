// Functions without outputs are called for their assertions (8.3.8, 11.2.1.1).
model Run
  function increasing
    input Real t[:];
  algorithm
    for k in 2:size(t, 1) loop
      assert(t[k] > t[k - 1], "not increasing");
    end for;
  end increasing;
  parameter Real t[3] = {1, 2, 3};
  Real x = time;
initial algorithm
  increasing(t);
equation
  increasing({0, 1, x + 2});
  // expect: x @ 1 = 1
end Run;
