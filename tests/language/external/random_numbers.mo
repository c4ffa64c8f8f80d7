// Generators of random numbers with a state that is handed on, before and during the run.  The numbers are those that the Modelica
// Association publishes for these seeds.
package P
  function draw64
    input Integer state[2];
    output Real number;
    output Integer next[2];
  external "C" ModelicaRandom_xorshift64star(state, next, number);
  end draw64;
  function draw128
    input Integer state[4];
    output Real number;
    output Integer next[4];
  external "C" ModelicaRandom_xorshift128plus(state, next, number);
  end draw128;
  function draw1024
    input Integer state[33];
    output Real number;
    output Integer next[33];
  external "C" ModelicaRandom_xorshift1024star(state, next, number);
  end draw1024;
  function started
    input Integer seed;
    input Integer n;
    output Integer state[n];
  protected
    Real number;
    Integer pair[2] = {seed, 30020};
  algorithm
    for k in 1:10 loop
      (number, pair) := draw64(pair);
    end for;
    for k in 1:2:n loop
      state[k] := pair[1];
      if k < n then
        state[k + 1] := pair[2];
      end if;
      (number, pair) := draw64(pair);
    end for;
  end started;
  function size64
    input Integer seed;
    output Integer n;
  protected
    Real number;
    Integer next[2];
  algorithm
    (number, next) := draw64(started(seed, 2));
    n := integer(10*number);
  end size64;
  model Run
    parameter Integer seed = 614657;
    // 10 times the first number, at translation
    Real x[size64(614657)] = fill(time, size64(614657));
    Integer s64[2];
    Integer s128[4];
    Integer s1024[33];
    discrete Real r64;
    discrete Real r128;
    discrete Real r1024;
  initial equation
    pre(s64) = started(seed, 2);
    pre(s128) = started(seed, 4);
    pre(s1024) = started(seed, 33);
  equation
    when sample(0, 0.05) then
      (r64, s64) = draw64(pre(s64));
      (r128, s128) = draw128(pre(s128));
      (r1024, s1024) = draw1024(pre(s1024));
    end when;
    // expect: x[3] @ 1 = 1
    // expect: r64 @ 0.01 = 0.3135925178776172
    // expect: r64 @ 0.06 = 0.5110345034226015
    // expect: r128 @ 0.01 = 0.4611540572500742
    // expect: r128 @ 0.06 = 0.03170147695200792
    // expect: r1024 @ 0.01 = 0.31155928686346324
    // expect: r1024 @ 0.06 = 0.059952099583051865
  end Run;
end P;
