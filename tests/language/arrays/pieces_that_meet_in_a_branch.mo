// Pieces of an array that share an element may stand in different branches only.
model Run
  Integer g[3](each start = 0, each fixed = true);
  Boolean c(start = true, fixed = true);
equation
  when sample(0.1, 0.2) then
    if pre(c) then
      g = {1, 2, 3};
      // error E0401: `g` is set twice by one branch of a `when`
      g[1] = 5;
    else
      g = pre(g);
    end if;
    c = not pre(c);
  end when;
end Run;
