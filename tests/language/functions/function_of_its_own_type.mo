// A function that gives a function like itself has no type that ends; it used up the stack.
model Run
  function c
    input Real u;
    output Real y;
    output c values[:]; // error E0208: `Run.c` takes or gives a function of its own type
  algorithm
    y := u;
  end c;
  Real z = c(time);
end Run;
