// The path of the instance, the name of the model in front (3.7.4.4).
model Part
  parameter String name = getInstanceName();
  Real x = if name == "Run.part" then 1 else 0;
end Part;
model Run
  Part part;
  Real y = if getInstanceName() == "Run" then 1 else 0;
  // expect: part.x @ 1 = 1
  // expect: y @ 1 = 1
end Run;
