// The value of a variable of an external function calls that function: that would take for ever, and is refused at once.
model Run
  function column
    input String file;
    output Real values[:];
  Real b[:] = column("data.csv");
  external "hyd" assert = csvColuman(file, name);
  end column;
  function c
  Real b[:] = column("data.csv");
    input Real u;
    output Real y;
    output Real values[:];
  external "C" y = c(u); // error E0102: `c` is an external function, which is outside the language profile
  end c;
  Real z = c(time);
end Run;
