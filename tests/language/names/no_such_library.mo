model D08
  // error E0202: there is no class `Modelica` here
  import Modelica.SIunits;
  // error E0202: there is no class `Modelica` here
  Modelica.Blocks.Sources.Sine s;
  SIunits.Length l;
  // error E0201: unknown name `y` in `D08`
  Real x = y.z;
  // error E0202: there is no class `Missing` here
  Missing m;
end D08;
