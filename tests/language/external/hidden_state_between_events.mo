// The generator with hidden state is drawn from at events only.
impure function draw
  input Integer id;
  output Real y;
  external "C" y = ModelicaRandom_impureRandom_xorshift1024star(id);
end draw;
model Test
  Real x = draw(1); // error E0102: `draw` draws from a generator with a hidden state, which is drawn from at events only
end Test;
