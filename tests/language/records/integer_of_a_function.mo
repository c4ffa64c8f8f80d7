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
  model Run
    Source source;
    Sink sink;
  equation
    connect(source.port, sink.port);
    // expect: sink.y @ 0.25 = 10.5
    // expect: sink.y @ 1 = 22
    // expect: source.own.phase @ 1 = 2
  end Run;
end P;
