// What only events change has no derivative.
model Run
  discrete Real held(start = 0, fixed = true);
  Real x(start = 0, fixed = true);
equation
  der(x) = 1 - der(held); // error E0218: `der(held)`: `held` changes at events only and has no derivative
  when sample(0, 0.1) then
    held = x;
  end when;
end Run;
