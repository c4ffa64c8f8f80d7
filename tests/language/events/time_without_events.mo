// Comparisons with the time cause no events in `noEvent` and in functions, in a `when` and in its condition, either.
function late
  input Real t;
  output Boolean b;
algorithm
  b := t > 0.35;
end late;
model Run
  discrete Real at(start = 0, fixed = true);
  discrete Real then_at(start = 0, fixed = true);
  Integer e(start = 0, fixed = true);
equation
  when late(time) then
    at = time;
  end when;
  when noEvent(time > 0.35) then
    then_at = time;
  end when;
  when sample(0.2, 0.2) then
    e = pre(e) + 1;
  end when;
  // expect: at @ 1 = 0.4
  // expect: then_at @ 1 = 0.4
end Run;
