// A function of continuous values returns a record with an Integer in it, as media do: it is taken as it is returned, and so is what is
// connected to it.
package P
  record State
    Integer phase;
    Real T;
  end State;
  function state_of
    input Real h;
    output State s;
  algorithm
    s := State(if h > 2 then 2 else 1, h/2);
  end state_of;
  function level
    input State s;
    output Real y;
  algorithm
    y := 10*s.phase + s.T;
  end level;
  connector Port
    Real p;
    flow Real q;
    State state;
  end Port;
  model Source
    Port port;
    Real h = 4*time;
    State own = state_of(h);
  equation
    port.p = 1;
    port.state = own;
  end Source;
  model Sink
    Port port;
    Real y = level(port.state);
  equation
    port.q = port.p;
  end Sink;
  model Switch "connected by the same kind of equation, and discrete"
    Modelica_BooleanInput u;
    Boolean y = not u;
  end Switch;
  connector Modelica_BooleanInput = input Boolean;
  connector Modelica_BooleanOutput = output Boolean;
  model Step
    Modelica_BooleanOutput y = time > 0.5;
  end Step;
  model Run
    Source source;
    Sink sink;
    Source several[3](each h = 3*time);
    Sink sinks[3];
    Step step;
    Switch switch;
  equation
    connect(source.port, sink.port);
    connect(several.port, sinks.port);
    connect(step.y, switch.u);
    // expect: sinks[3].y @ 1 = 21.5
    // expect: switch.y @ 1 = 0
    // expect: sink.y @ 0.25 = 10.5
    // expect: sink.y @ 1 = 22
    // expect: source.own.phase @ 1 = 2
  end Run;
end P;
