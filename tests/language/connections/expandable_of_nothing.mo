expandable connector Bus
end Bus;
model Run
  Bus a;
  Bus b;
equation
  connect(
    a.x, // error E0303: nothing says what `x` is: no connector is connected to it
    b.x); // error E0303: nothing says what `x` is: no connector is connected to it
end Run;
