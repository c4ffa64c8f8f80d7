// Functions as inputs, by name or with some of their inputs given (12.4.2): run symbolically, compiled where a loop asks for values of
// the run, handed on, and for records.
partial function F "Of one number"
  input Real u;
  output Real y;
end F;
function root "By halves"
  input F f;
  input Real low;
  input Real high;
  output Real u;
protected
  Real a = low;
  Real b = high;
algorithm
  while b - a > 1E-12 loop
    u := (a + b)/2;
    if f(u) < 0 then
      a := u;
    else
      b := u;
    end if;
  end while;
  u := (a + b)/2;
end root;
function simpson
  input F f;
  input Real a;
  input Real b;
  output Real area;
algorithm
  area := (b - a)/6*(f(a) + 4*f((a + b)/2) + f(b));
end simpson;
function twice "Hands on what it was handed"
  input F f;
  input Real a;
  output Real y = 2*simpson(f, 0, a);
end twice;
record Line
  Real slope;
  Real offset;
end Line;
function line
  extends F;
  input Line line;
algorithm
  y := line.slope*u + line.offset;
end line;
function cube
  extends F;
algorithm
  y := u^3;
end cube;
function power "The open input is not the first one"
  input Real factor = 1;
  input Real u;
  input Integer n;
  output Real y = factor*u^n;
end power;
model Run
  parameter Line l = Line(2, -1);
  Real area = simpson(cube, 0, time);
  Real of_line = simpson(function line(line = Line(slope = time, offset = 1)), 0, 2);
  Real both = twice(function power(n = 2, factor = time), 3);
  Real zero = root(function line(line = l), -10, 10);
  Real moving = root(function line(line = Line(slope = 3, offset = -time)), 0, 5);
  // stop: 2
  // expect: area @ 2 = 4
  // expect: of_line @ 1 = 4
  // expect: both @ 2 = 36
  // expect: zero @ 1 = 0.5
  // expect: moving @ 2 = 2/3 +- 1E-9
end Run;
