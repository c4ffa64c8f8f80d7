// External functions of Strings are computed at translation.
package P
  function length
    input String text;
    output Integer n;
  external "C" n = ModelicaStrings_length(text);
  end length;
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
    Integer next;
    Real number;
    Real x[n] = fill(time, n);
  equation
    (next, number) = scan(text, 4);
    // expect: x[11] @ 1 = 1
    // expect: number @ 1 = 2.5
    // expect: next @ 1 = 8
  end Run;
end P;
