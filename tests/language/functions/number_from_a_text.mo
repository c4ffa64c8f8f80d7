// What a function finds in a text is known before the run, however it takes the text apart.
model Run
  record Token
    String text;
    Real number;
  end Token;
  function token
    input String all;
    input Integer from;
    output Token found;
    output Integer next;
  algorithm
    found.text := "";
    found.number := 0;
    next := from;
    if from == 1 then
      found.text := "gain";
      next := 2;
    else
      found.number := if all == "gain = 3" then 3 else 4;
      next := 3;
    end if;
  end token;
  function read
    input String all;
    input String name;
    output Real value;
  protected
    Token here;
    Integer next = 1;
  algorithm
    (here, next) := token(all, next);
    if here.text == name then
      (here, next) := token(all, next);
      value := here.number;
    else
      value := -1;
    end if;
  end read;
  parameter String line = "gain = 3";
  parameter Real k = read(line, "gain");
  parameter Real other = read("gain = 2", name = "gain");
  parameter Real missing = read(line, "offset");
  Real x(start = 1, fixed = true);
equation
  der(x) = -k*x;
end Run;
// expect: k @ 0 = 3
// expect: other @ 0 = 4
// expect: missing @ 0 = -1
// expect: x @ 1 = exp(-3)
