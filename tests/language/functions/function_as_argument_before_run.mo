// Functions as arguments where the value must be known before the run: here it is a size.
partial function F
  input Real u;
  output Real y;
end F;
function root "By halves"
  input F f;
  input Real low;
  input Real high;
  output Real x;
protected
  Real a = low;
  Real b = high;
algorithm
  while b - a > 1e-9 loop
    x := (a + b)/2;
    if f(x)*f(a) > 0 then
      a := x;
    else
      b := x;
    end if;
  end while;
end root;
function handed_on
  input F f;
  output Real x = root(f, 0, 10);
end handed_on;
function line
  extends F;
  input Real slope = 1;
  input Real offset;
algorithm
  y := slope*u + offset;
end line;
function square
  extends F;
algorithm
  y := u^2 - 4;
end square;
model Run
  constant Real three = handed_on(function line(slope = 2, offset = -6));
  constant Real two = root(square, 0, 10);
  Real x[integer(three + 0.5)] = {1, 2, 3}*time;
  Real y[integer(two + 0.5)] = {1, 2}*time;
  // expect: x[3] @ 1 = 3
  // expect: y[2] @ 1 = 2
end Run;
