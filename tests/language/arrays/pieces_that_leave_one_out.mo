// A branch that leaves out an element keeps its message.
model Run
  Boolean g[3](each start = true, each fixed = true);
equation
  when sample(0.1, 0.1) then
    if time < 0.15 then // error E0401: the branches of an `if` that is decided during the run must set the same variables, but not all set `g[{1, 3}]`
      g[{1, 3}] = {false, false};
    else
      g = pre(g);
    end if;
  end when;
end Run;
