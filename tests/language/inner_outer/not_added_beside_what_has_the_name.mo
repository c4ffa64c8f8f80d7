// Nothing is added where something else in the model that is run has the name.
package P
  model World
    parameter Real g = 10;
  end World;
  model Body
    outer World v; // error E0201: no enclosing model declares `inner v`
    outer World w; // error E0201: no enclosing model declares `inner w`
    Real y = w.g + v.g;
  end Body;
  model Run
    Body body;
    parameter Integer v = 2;
    function w
      input Real u;
      output Real y = u;
    algorithm
    end w;
    Real q = w(3);
  end Run;
end P;
