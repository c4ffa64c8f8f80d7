// What would only act outside of the model is not called, which is said.
package P
  function print
    input String text;
  external "C" ModelicaInternal_print(text, "");
  end print;
  model Run
    Real x = time;
  equation
    when time > 0.5 then
      print("half past"); // warning E0102: `ModelicaInternal_print` is not called: it would only act outside of the model
    end when;
    // expect: x @ 1 = 1
  end Run;
end P;
