// Elements change places as the run decides; a `break` ends a search.
model AlgoBubble "sort in model algorithm with run-time decisions"
  Real u[4] = {sin(time), 0.3, 0.1, 0.2};
  Real s[4];
  Real t;
  Integer first;
algorithm
  s := u;
  for i in 1:3 loop
    for j in 1:4-i loop
      if s[j] > s[j+1] then
        t := s[j];
        s[j] := s[j+1];
        s[j+1] := t;
      end if;
    end for;
  end for;
  first := 0;
  for i in 1:4 loop
    if u[i] > 0.25 then
      first := i;
      break;
    end if;
  end for;
  // expect: s[4] @ 1 = sin(1)
  // expect: s[1] @ 1 = 0.1
  // expect: s[1] @ 0 = 0
  // expect: first @ 0 = 2
  // expect: first @ 1 = 1
end AlgoBubble;
