// A component hides the function of its name (Modelica 3.6, section 5.3.1).
model Run
  Real max = 3;
  Real y = max(time, 1); // error E0214: `max` is not a function
end Run;
