// A final parameter that is 0 for good takes the current out of `R*i = v`, which then says that two voltages are equal.
record Card
  parameter Real RD = -1e40;
  parameter Real sheet = 0;
end Card;
record Device
  Real given;
  Real R;
end Device;
function renamed
  input Card card;
  output Device device;
algorithm
  device.given := if card.RD > -1e40 then 1 else 0;
  device.R := if card.RD > -1e40 then card.RD else 0;
end renamed;
model Part
  parameter Card card annotation(Evaluate = true);
  parameter Real area = 3;
  final parameter Device p = renamed(card);
  // The area counts only where a sheet resistance is given.
  final parameter Real R = if p.given > 0.5 then p.R elseif card.sheet > 0 then area*card.sheet else 0;
  Real above(start = 1, fixed = true);
  Real inside;
  Real i;
equation
  R*i = above - inside;
  der(above) = -i;
  der(inside) = i - inside;
end Part;
model Run
  Card own;
  Part ideal;
  Part given(card = own);
  Part resisting(card(RD = 2), inside(start = 0, fixed = true));
  // expect: ideal.inside @ 1 = exp(-0.5)
  // expect: ideal.i @ 1 = 0.5*exp(-0.5)
  // expect: ideal.p.R @ 1 = 0
  // expect: given.inside @ 1 = exp(-0.5)
  // expect: resisting.i @ 0 = 0.5
end Run;
