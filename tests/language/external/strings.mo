// External functions of Strings are computed at translation.
package P
  function length
    input String text;
    output Integer n;
  external "C" n = ModelicaStrings_length(text);
  end length;
  function hash
    input String text;
    output Integer n;
  external "C" n = ModelicaStrings_hashString(text);
  end hash;
  function scan
    input String text;
    input Integer start;
    output Integer next;
    output Real number;
  external "C" ModelicaStrings_scanReal(text, start, false, next, number);
  end scan;
  model Run
    parameter String text = "p = 2.5 bar";
    parameter Integer n = length(text);
    // Values that the documentation of Modelica.Utilities.Strings gives.
    parameter Integer h[2] = {hash("this is a test"), hash("Controller.noise1")};
    Integer next;
    Real number;
    Real x[n] = fill(time, n);
  equation
    (next, number) = scan(text, 4);
    // expect: h[1] @ 0 = 1827717433
    // expect: h[2] @ 0 = -1025762750
    // expect: x[11] @ 1 = 1
    // expect: number @ 1 = 2.5
    // expect: next @ 1 = 8
  end Run;
end P;
