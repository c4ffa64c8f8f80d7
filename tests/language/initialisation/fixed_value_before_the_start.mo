// One that is fixed stands, and an initial equation that says another one contradicts it.
model Run
  Boolean closed = time < 0.5;
  Boolean open(start = true, fixed = true) = not closed;
initial equation
  pre(open) = not closed;
  // note N0401 without line: the initial equation `pre(open) = not closed` follows from the other conditions and is only checked
  // run error: the initial equation `pre(open) = not closed` contradicts the other conditions
end Run;
