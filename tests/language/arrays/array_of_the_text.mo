// A function `array` of the text hides that of the language.
package P
  function array
    input Real x;
    output Real y[1] = {2*x};
  algorithm
  end array;
  package Q
    function f
      output Real y[2] = .array(1.0, 2.0);
    algorithm
    end f;
  end Q;
  model Run
    Real y[1] = array(3.0);
    parameter Real z[1] = array(4.0);
    Real w[2] = Q.f();
    // expect: y[1] @ 0 = 6
    // expect: z[1] @ 0 = 8
    // expect: w[2] @ 0 = 2
  end Run;
end P;
