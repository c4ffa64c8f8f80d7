// Lines of a text file, read before the run.
package P
  function line
    input String file;
    input Integer number;
    output String text;
    output Boolean ended;
  external "C" text = ModelicaInternal_readLine(file, number, ended);
  end line;
  function lines
    input String file;
    output Integer n;
  external "C" n = ModelicaInternal_countLines(file);
  end lines;
  function length
    input String text;
    output Integer n;
  external "C" n = ModelicaStrings_length(text);
  end length;
  function of_line
    input String file;
    input Integer number;
    output Integer n;
  protected
    String text;
    Boolean ended;
  algorithm
    (text, ended) := line(file, number);
    n := if ended then -1 else length(text);
  end of_line;
  model Run
    parameter Integer n = lines("lines.txt");
    parameter Integer first = of_line("lines.txt", 1);
    parameter Integer second = of_line("lines.txt", 2);
    parameter Integer behind = of_line("lines.txt", 4);
    Real x = time;
    // expect: n @ 0 = 3
    // expect: first @ 0 = 5
    // expect: second @ 0 = 0
    // expect: behind @ 0 = -1
  end Run;
end P;
