// A type stands for the number of its values; a list of such values is no size.
model Run
  type Speed = enumeration(off, slow, fast);
  parameter Boolean chosen[3] = {true, false, true};
  constant Speed speeds[2] = {Speed.off, Speed.fast};
  Real of_type[Speed] = {1, 2, 3};
  Real of_both[Boolean] = {1, 2};
  Real x[chosen]; // error E0204: the size of `x` must be an Integer, not array of Boolean
  Real y[speeds]; // error E0204: the size of `y` must be an Integer, not array of Run.Speed
end Run;
