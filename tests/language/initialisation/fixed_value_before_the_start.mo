// One that is fixed stands, and an initial equation that says another one contradicts it.
model Run
  Boolean closed = time < 0.5;
  Boolean open(start = true, fixed = true) = not closed;
initial equation
  pre(open) = not closed;
  // note N0401 without line: the initial equation `pre(open) = not closed` is not needed to determine the start, and is only checked
  // run error: the initial equation `pre(open) = not closed` contradicts the start value of `open`, which gives 1
end Run;
