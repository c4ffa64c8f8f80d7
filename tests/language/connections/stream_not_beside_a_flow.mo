connector Port
  Real p;
  stream Real h;
end Port;
model Part
  Port port; // error E0303: a connector with stream variables needs one flow variable that is a scalar
equation
  port.p = 1;
  port.h = 2;
end Part;
model Run
  Part a;
end Run;
