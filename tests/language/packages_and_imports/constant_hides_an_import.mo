// What is declared further in hides what is imported further out, also a constant a package, also where one of its elements is meant.
package Library
  package Numbers
    constant Real half = 0.5;
  end Numbers;
  record Pair
    Real half;
    Real whole;
  end Pair;
  package Outside
    import Library.Numbers;
    package Inside
      // warning W0202: `Numbers` hides the import `Numbers`
      constant Pair Numbers(half = 3, whole = 6);
      function whole
        output Real y;
      algorithm
        y := Numbers.whole + Numbers.half;
      end whole;
    end Inside;
    function half
      output Real y;
    algorithm
      y := Numbers.half;
    end half;
  end Outside;
end Library;
model Run
  Real x = Library.Outside.Inside.whole();
  Real y = Library.Outside.half();
  // expect: x @ 1 = 9
  // expect: y @ 1 = 0.5
end Run;
