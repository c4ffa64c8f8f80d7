// A place in a list that an initial algorithm finds from what is known before the run decides a subscript.
model Run
  parameter String names[3] = {"oil", "air", "water"};
  parameter String wanted = "air";
  Real all[3] = {time, 2*time, 3*time};
  Real y = all[place];
protected
  parameter Integer place(fixed = false);
initial algorithm
  place := -1;
  for k in 1:3 loop
    if names[k] == wanted then
      place := k;
    end if;
  end for;
  assert(place > 0, "no such name");
  // expect: y @ 1 = 2
  // expect: place @ 1 = 2
end Run;
