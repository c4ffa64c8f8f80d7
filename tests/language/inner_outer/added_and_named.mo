// The text of the model that is run does not declare what is added.
package P
  block Source
    input Real u;
    output Real y = 2*u;
  end Source;
  model Body
    outer Source src; // warning W0204: no enclosing model declares `inner src`: `P.Source` is added with its defaults
    Real y = src.y;
  end Body;
  model Run
    Body a;
  equation
    src.u = 3; // error E0201: unknown name `src` in `P.Run`
  end Run;
end P;
