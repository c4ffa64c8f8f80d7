// How often a loop that the run decides draws is not known: a compiled function does not draw.
impure function draw
  input Integer id;
  output Real y;
  external "C" y = ModelicaRandom_impureRandom_xorshift1024star(id);
end draw;
impure function until
  input Real u;
  output Real y;
algorithm
  y := 0;
  while y < u loop
    y := y + draw(1); // error E0102: `draw` draws from a generator with a hidden state, which is drawn from at events only
  end while;
end until;
model Test
  discrete Real x(start = 0, fixed = true);
equation
  when sample(0, 0.1) then
    x = until(3*time);
  end when;
end Test;
