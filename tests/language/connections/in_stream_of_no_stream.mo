model Run
  Real x = time;
  Real y = inStream(x); // error E0214: `inStream` needs a stream variable of a connector
end Run;
