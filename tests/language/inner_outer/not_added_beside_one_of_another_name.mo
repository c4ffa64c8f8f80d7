// An `inner` of a fitting class and another name, or one without `inner`, is likely what is meant: no second one is added beside it.
package P
  model World
    parameter Real g = 10;
  end World;
  model Better
    extends World;
    parameter Real more = 1;
  end Better;
  model Other
    parameter Real T = 300;
  end Other;
  model Body
    outer World world; // error E0201: no enclosing model declares `inner world`
    outer Other other; // error E0201: no enclosing model declares `inner other`
    Real y = world.g + other.T;
  end Body;
  model Run
    inner Better world_1;
    Other other;
    Body a;
  end Run;
end P;
