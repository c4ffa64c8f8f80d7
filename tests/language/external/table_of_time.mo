// A table of time with a jump, repeated: the block keeps the next event, the function is asked with it.
package P
  class Table
    extends ExternalObject;
    function constructor
      input Real table[:, :];
      input Real start;
      input Integer outside;
      input Real shift;
      output Table made;
    external "C" made = ModelicaStandardTables_CombiTimeTable_init3("NoName", "NoName", table, size(table, 1), size(table, 2), start, {2}, 1, 1, outside, shift, 1, false, ",", 0);
    end constructor;
    function destructor
      input Table made;
    external "C" ModelicaStandardTables_CombiTimeTable_close(made);
    end destructor;
  end Table;
  function value
    input Table table;
    input Real t;
    input Real next;
    input Real before;
    output Real y;
  external "C" y = ModelicaStandardTables_CombiTimeTable_getValue(table, 1, t, next, before);
  end value;
  function nextEvent
    input Table table;
    input Real t;
    output Real next;
  external "C" next = ModelicaStandardTables_CombiTimeTable_nextTimeEvent(table, t);
  end nextEvent;
  block Source
    parameter Real start = 0;
    parameter Real shift = 0;
    parameter Integer outside = 2;
    parameter Table table = Table([0, 0; 0.1, 1; 0.1, 3; 0.2, 3; 0.4, 1], start, outside, shift);
    discrete Real next(start = 0, fixed = true);
    Real y = value(table, time, next, pre(next));
  equation
    when {time >= pre(next), initial()} then
      next = nextEvent(table, time);
    end when;
  end Source;
  model Run
    Source line;
    Source late(start = 0.5, shift = 0.5, outside = 1);
    Source again(outside = 3);
    Real q(start = 0, fixed = true);
  equation
    der(q) = again.y;
    // expect: line.y @ 0.05 = 0.5
    // expect: line.y @ 0.1 = 3
    // expect: line.y @ 0.3 = 2
    // expect: line.y @ 0.5 = 0
    // expect: late.y @ 0.4 = 0
    // expect: late.y @ 0.55 = 0.5
    // expect: late.y @ 0.6 = 3
    // expect: late.y @ 1 = 1
    // expect: again.y @ 0.45 = 0.5
    // expect: again.y @ 0.5 = 3
    // expect: again.y @ 0.9 = 3
    // expect: q @ 0.8 = 1.5
  end Run;
end P;
