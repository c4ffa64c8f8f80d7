model Run
  Clock c = Clock(0.1);
  Integer n(start = 0);
equation
  when c then // error E0216: a `when` of a clock has no `elsewhen`: each clock is a `when` of its own
    n = previous(n) + 1;
  elsewhen time > 1 then
    n = 0;
  end when;
end Run;
