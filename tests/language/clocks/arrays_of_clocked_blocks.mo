// Vectors and arrays of components with clocks, each element with a clock of its own.
block Counter
  parameter Integer ticks = 1;
  output Integer n(start = 0);
  input Clock clock;
equation
  when clock then
    n = previous(n) + 1;
  end when;
end Counter;
block Buffer
  parameter Integer size = 3;
  input Real u;
  output Real y;
protected
  Real b[size + 1](each start = 0);
equation
  b = cat(1, {u}, previous(b[1:size]));
  y = b[size + 1];
end Buffer;
model Run
  Counter c[2];
  Clock fast = Clock(1, 10);
  Buffer line;
  Real u[2] = {time, 2*time};
  Real y[2];
equation
  c[1].clock = fast;
  c[2].clock = subSample(fast, 4);
  y = sample(u, fast);
  line.u = sample(time, fast);
  // expect: c[1].n @ 0.95 = 10
  // expect: c[2].n @ 0.95 = 3
  // expect: y[2] @ 0.35 = 0.6
  // expect: line.y @ 0.75 = 0.4
end Run;
