// A seed that time would decide elsewhere is one number here, which is said.
package P
  function seed
    output Integer n;
  external "C" n = ModelicaRandom_automaticGlobalSeed(0.0);
  end seed;
  model Run
    parameter Integer n = seed(); // warning E0102: an automatic seed is always 614657441, so that runs can be repeated
    Real x = time;
    // expect: n @ 0 = 614657441
  end Run;
end P;
