// What only has the same elements, or only the same name, keeps no element from being added.
package P
  model Settings
    parameter Boolean animation = true;
  end Settings;
  model World
    parameter Boolean animation = false;
    parameter Real g = 10;
  end World;
  model Wind
    parameter Real v = 10;
  end Wind;
  model Body
    outer World world;
    outer Settings settings; // warning W0204: no enclosing model declares `inner settings`: `P.Settings` is added with its defaults
    outer Wind w; // warning W0204: no enclosing model declares `inner w`: `P.Wind` is added with its defaults
    Real y = if settings.animation then world.g + w.v else 0;
  end Body;
  model Holder
    parameter Integer w = 3;
    Body body;
  end Holder;
  model None
    outer Settings others;
    Real y = if others.animation then 1 else 0;
  end None;
  model Base
    extends World(g = 1);
  end Base;
  model Run
    inner Base world;
    Holder holder;
    None none[0];
    // expect: holder.body.y @ 0 = 11
    // absent: others.animation
  end Run;
end P;
