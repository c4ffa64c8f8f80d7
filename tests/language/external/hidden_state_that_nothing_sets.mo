// Without a seed there are no numbers.
impure function draw
  input Integer id;
  output Real y;
  external "C" y = ModelicaRandom_impureRandom_xorshift1024star(id);
end draw;
model Test
  discrete Real x(start = 0, fixed = true);
equation
  when sample(0, 0.1) then
    x = draw(1); // error E0102: random numbers are drawn here from a generator that nothing sets up
  end when;
end Test;
