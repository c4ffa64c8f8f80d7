package P
  class Table
    extends ExternalObject;
    function constructor
      input Real table[:, :];
      input Integer smoothness;
      input Integer outside;
      output Table made;
    external "C" made = ModelicaStandardTables_CombiTable2D_init3("NoName", "NoName", table, size(table, 1), size(table, 2), smoothness, outside, false, ",", 0);
    end constructor;
    function destructor
      input Table made;
    external "C" ModelicaStandardTables_CombiTable2D_close(made);
    end destructor;
  end Table;
  function value
    input Table table;
    input Real u;
    input Real v;
    output Real y;
  external "C" y = ModelicaStandardTables_CombiTable2D_getValue(table, u, v);
  end value;
  model Run
    parameter Real data[:, :] = [0, 0, 1, 2; 0, 1, 2, 3; 2, 3, 6, 9];
    Table lines = Table(data, 1, 2);
    Table held = Table(data, 1, 1);
    Table steps = Table(data, 3, 1);
    Real a = value(lines, time, 0.5);
    Real b = value(lines, 3*time, 3);
    Real c = value(held, 3*time, 3);
    Real d = value(steps, 1.9, 1.1*time);
    // expect: a @ 1 = 3
    // expect: b @ 1 = 16
    // expect: c @ 1 = 9
    // expect: d @ 0.5 = 1
    // expect: d @ 1 = 2
  end Run;
end P;
