// The run cannot decide on sizes.
model Run
  Real s = sum(if time > 0.5 then {time} else {time, 2*time}); // error E0207: the branches have different sizes: [1] and [2]
end Run;
