// An element of a partial class cannot be added.
package P
  partial model World
    parameter Real g = 10;
  end World;
  model Body
    outer World world; // error E0201: no enclosing model declares `inner world`
    Real y = world.g;
  end Body;
  model Run
    Body a;
  end Run;
end P;
