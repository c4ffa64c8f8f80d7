// Numbers drawn from the generator with hidden state, beside the same generator with a state of its own: places draw in the order of
// the text, a place in a branch only where the branch is taken, each turn of a loop for itself; all outputs of a call share what it draws.
package Draws
  impure function setState
    input Integer[33] state;
    input Integer id;
    external "C" ModelicaRandom_setInternalState_xorshift1024star(state, size(state, 1), id);
  end setState;

  function start "The first state"
    input Integer seed;
    output Integer state[33];
  algorithm
    for k in 1:32 loop
      state[k] := 1000003*k + seed;
    end for;
    state[33] := 5;
  end start;

  impure function begin
    input Integer seed;
    output Integer id;
  protected
    Integer state[33];
  algorithm
    state := start(seed);
    id := 7;
    setState(state, id);
  end begin;

  impure function draw
    input Integer id;
    output Real y;
    external "C" y = ModelicaRandom_impureRandom_xorshift1024star(id);
  end draw;

  impure function two
    input Integer id;
    output Real first;
    output Real later;
  algorithm
    later := 0;
    first := draw(id);
    for k in 1:2 loop
      later := later + k*draw(id);
    end for;
  end two;

  impure function perhaps
    input Integer id;
    input Real u;
    output Real y;
  algorithm
    if u > 0.5 then
      y := draw(id);
    else
      y := -draw(id) - draw(id);
    end if;
  end perhaps;

  impure function pair
    input Integer id;
    output Real y[2];
  algorithm
    y := {draw(id), draw(id)};
  end pair;
end Draws;

// Two of a class, and two in an array, draw for themselves, also where a function of all of them draws.
block Source
  parameter Integer id;
  discrete Real y(start = 0, fixed = true);
  discrete Real z(start = 0, fixed = true);
equation
  when sample(0.01, 0.05) then
    y = Draws.draw(id);
    z = Draws.perhaps(id, 1);
  end when;
end Source;

model Test
  Source one_source(id = id);
  Source other_source(id = id);
  Source several[2](each id = id);
  discrete Real taken[8](each start = 0, each fixed = true) "the numbers that the four sources drew";
  discrete Real drawn[8](each start = 0, each fixed = true) "eight numbers of the state that is written down";
  parameter Integer seed = 4711;
  parameter Integer id = Draws.begin(seed);
  discrete Real first(start = 0, fixed = true), later(start = 0, fixed = true), one(start = 0, fixed = true);
  discrete Real v[3](each start = 0, each fixed = true), w[2](each start = 0, each fixed = true);
  discrete Real branch(start = 0, fixed = true), choice(start = 0, fixed = true);
  discrete Real x(start = 0, fixed = true), y(start = 0, fixed = true);
  Integer branches(start = 0, fixed = true) "draws of one kind in the branch, among 40";
  Real height(start = 0, fixed = true);
  // The same with a state that is written down.
  Integer s[33];
  discrete Real difference(start = 0, fixed = true), newest(start = 0, fixed = true);
protected
  Real p, q, r;
equation
  when sample(0, 0.05) then
    (first, later) = Draws.two(id);
    one = Draws.draw(id);
    v = {k*Draws.draw(id) for k in 1:3};
    w = Draws.pair(id);
    branch = Draws.perhaps(id, one);
    choice = if one > 0.5 then -Draws.draw(id) else 2;
    reinit(height, Draws.draw(id));
  end when;
  der(height) = 0;
  when sample(0.015, 0.05) then
    taken = {one_source.y, one_source.z, other_source.y, other_source.z, several[1].y, several[1].z, several[2].y, several[2].z};
  end when;
algorithm
  when sample(0.02, 0.05) then
    x := Draws.draw(id);
    if x > 0.25 then
      y := Draws.draw(id);
    end if;
  end when;
algorithm
  when initial() then
    s := Draws.start(seed);
  elsewhen sample(0, 0.05) then
    // What starts a state again is read before what is set, and seen after the event.
    (p, s) := Hyd.Random.xorshift1024star(s);
    newest := p;
    difference := 0;
    (p, s) := Hyd.Random.xorshift1024star(s);
    (q, s) := Hyd.Random.xorshift1024star(s);
    (r, s) := Hyd.Random.xorshift1024star(s);
    difference := difference + abs(first - p) + abs(later - (q + 2*r));
    (p, s) := Hyd.Random.xorshift1024star(s);
    difference := difference + abs(one - p);
    for k in 1:3 loop
      (q, s) := Hyd.Random.xorshift1024star(s);
      difference := difference + abs(v[k] - k*q);
    end for;
    for k in 1:2 loop
      (q, s) := Hyd.Random.xorshift1024star(s);
      difference := difference + abs(w[k] - q);
    end for;
    (q, s) := Hyd.Random.xorshift1024star(s);
    if p > 0.5 then
      difference := difference + abs(branch - q);
      branches := branches + 1;
      (q, s) := Hyd.Random.xorshift1024star(s);
      difference := difference + abs(choice + q);
    else
      (r, s) := Hyd.Random.xorshift1024star(s);
      difference := difference + abs(branch + q + r) + abs(choice - 2);
    end if;
    difference := difference + pre(difference);
  elsewhen sample(0.01, 0.05) then
    for k in 1:8 loop
      (drawn[k], s) := Hyd.Random.xorshift1024star(s);
    end for;
  elsewhen sample(0.02, 0.05) then
    // In whatever order they drew, they drew these eight.
    difference := pre(difference) + abs(sum(taken) - sum(drawn)) + abs(sum(taken[k]^2 for k in 1:8) - sum(drawn[k]^2 for k in 1:8));
    (p, s) := Hyd.Random.xorshift1024star(s);
    difference := difference + abs(height - newest) + abs(x - p);
    if p > 0.25 then
      (p, s) := Hyd.Random.xorshift1024star(s);
      difference := difference + abs(y - p);
    end if;
  end when;
end Test;
// stop: 2
// expect: difference @ 2 = 0 abs 1e-12
// expect: branches @ 2 = 22 abs 12
