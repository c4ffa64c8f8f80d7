// A bus has what is connected to it (Modelica 3.6, section 9.1.3); what it declares and nothing is connected to is not part of the model.
connector RealInput = input Real;
connector RealOutput = output Real;
connector BooleanOutput = output Boolean;
connector Pin
  Real v;
  flow Real i;
end Pin;
expandable connector Bus
  Real speed;
  Real never;
  SubBus sub;
end Bus;
expandable connector SubBus
  Real torque;
end SubBus;
expandable connector Empty
end Empty;
model Source
  parameter Real k = 1;
  RealOutput y = k*time;
end Source;
model Sensor
  Bus bus;
  Source speed(k = 2);
  Source torque(k = 3);
  Source undeclared(k = 4);
equation
  connect(speed.y, bus.speed);
  connect(bus.sub.torque, torque.y);
  connect(undeclared.y, bus.extra);
end Sensor;
model User
  Bus bus;
  RealInput speed;
  RealInput extra;
  Real torque = inner_.u;
  block Inner
    RealInput u;
  end Inner;
  Inner inner_;
equation
  connect(bus.speed, speed);
  connect(bus.extra, extra);
  connect(bus.sub.torque, inner_.u);
end User;
block Flag
  BooleanOutput y = time > 0.5;
end Flag;
model Level
  Pin p;
equation
  p.v = 2;
end Level;
model Part
  Pin p;
equation
  p.i = p.v;
end Part;
model Load
  Empty bus;
  Part part;
equation
  connect(part.p, bus.pin);
end Load;
model Run
  Sensor sensor;
  User user;
  Bus bus;
  Empty other;
  Flag flag;
  Boolean seen;
  Level level;
  Load load;
equation
  connect(sensor.bus, bus);
  connect(bus, user.bus);
  connect(flag.y, other.flag);
  seen = other.flag;
  connect(load.bus, other);
  connect(other.pin, level.p);
  // expect: user.speed @ 1 = 2
  // expect: user.torque @ 1 = 3
  // expect: user.extra @ 1 = 4
  // expect: bus.extra @ 1 = 4
  // expect: bus.never @ 1 = 0
  // expect: seen @ 1 = 1
  // expect: level.p.i @ 1 = -2
end Run;
