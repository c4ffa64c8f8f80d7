// Tables as the standard library of Modelica names them: an external object and functions that ask it (12.9.7).
package P
  type Smoothness = enumeration(linear, akima, steps, fritschButland, steffen, modifiedAkima);
  type Outside = enumeration(hold, line, periodic, none);
  class Table
    extends ExternalObject;
    function constructor
      input String name;
      input String file;
      input Real table[:, :];
      input Integer columns[:];
      input Smoothness smoothness;
      input Outside outside;
      output Table made;
    external "C" made = ModelicaStandardTables_CombiTable1D_init3(file, name, table, size(table, 1), size(table, 2), columns, size(columns, 1), smoothness, outside, false, ",", 0);
    end constructor;
    function destructor
      input Table made;
    external "C" ModelicaStandardTables_CombiTable1D_close(made);
    end destructor;
  end Table;
  function value
    input Table table;
    input Integer column;
    input Real u;
    output Real y;
  external "C" y = ModelicaStandardTables_CombiTable1D_getValue(table, column, u);
  end value;
  function slope
    input Table table;
    input Integer column;
    input Real u;
    input Real du;
    output Real dy;
  external "C" dy = ModelicaStandardTables_CombiTable1D_getDerValue(table, column, u, du);
  end slope;
  function largest
    input Table table;
    output Real u;
  external "C" u = ModelicaStandardTables_CombiTable1D_maximumAbscissa(table);
  end largest;
  model Run
    parameter Real data[:, 3] = [0, 0, 1; 1, 2, 1; 3, 4, 5];
    Table lines = Table("NoName", "NoName", data, 2:3, Smoothness.linear, Outside.line);
    Table held = Table("NoName", "NoName", data, {2}, Smoothness.linear, Outside.hold);
    Table steps = Table("NoName", "NoName", data, {3}, Smoothness.steps, Outside.periodic);
    Real u = 4*time;
    Real y[2];
    Real h = value(held, 1, u);
    Real s = value(steps, 1, u - 5);
    Real d = slope(lines, 1, u, 4);
    Real v = der(y[1]);
    Real m = largest(lines);
  equation
    for k in 1:2 loop
      y[k] = value(lines, k, u);
    end for;
    // expect: y[1] @ 0.2 = 1.6
    // expect: y[1] @ 0.5 = 3
    // expect: y[2] @ 0.5 = 3
    // expect: y[1] @ 1 = 5
    // expect: h @ 1 = 4
    // expect: s @ 0.1 = 1
    // expect: s @ 0.5 = 1
    // expect: d @ 0.2 = 8
    // expect: v @ 0.2 = 8
    // expect: v @ 0.5 = 4
    // expect: m @ 1 = 3
  end Run;
end P;
