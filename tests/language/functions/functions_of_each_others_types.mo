model Run
  function a
    input Real u;
    input b g;
    output Real y = u;
  end a;
  function b
    input Real u;
    input a f; // error E0208: `Run.a` takes or gives a function of its own type
    output Real y = u;
  end b;
  Real z = a(time, b);
end Run;
