// An array over an enumeration, read at the literal of the moment.
package P
  type Gear = enumeration(neutral "N", first "1", second "2");
  function ratio
    input Gear g;
    output Real r;
  algorithm
    if g == Gear.neutral then
      r := 0;
    elseif g == Gear.first then
      r := 3.5;
    else
      r := 2.1;
    end if;
  end ratio;
  model Run
    parameter Real tab[Gear] = {0, 3.5, 2.1};
    Gear g(start = Gear.neutral, fixed = true);
    Real r = ratio(g);
    Real r2 = tab[g];
    Integer k = Integer(g);
    Real count[Gear](each start = 0, each fixed = true);
  equation
    when time > 0.3 then
      g = Gear.first;
    elsewhen time > 0.6 then
      g = Gear.second;
    end when;
    for e in Gear loop
      der(count[e]) = if g == e then 1 else 0;
    end for;
    // expect: r @ 0.5 = 3.5
    // expect: r2 @ 1 = 2.1
    // expect: k @ 1 = 3
    // expect: r2 @ 0 = 0
    // expect: count[1] @ 1 = 0.3
    // expect: count[2] @ 1 = 0.3
    // expect: count[3] @ 1 = 0.4
  end Run;
end P;
