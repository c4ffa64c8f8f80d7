// A field of a record that is given to a function decides sizes in it.
model Run
  record Winding
    parameter Integer m;
    parameter Integer slots[:];
    parameter Real f;
  end Winding;
  record Three
    extends Winding(m = 3, slots = {1, 2}, f = 2);
  end Three;
  function turns
    input Winding w;
    output Real n[w.m];
  protected
    Integer z[w.m, size(w.slots, 1)];
    Integer k[w.m] = zeros(w.m);
  algorithm
    for i in 1:w.m loop
      for j in 1:size(w.slots, 1) loop
        z[i, j] := w.slots[j] + i;
      end for;
      if z[i, 1] > 2 then
        k[i] := k[i] + 1;
      end if;
      n[i] := w.f*z[i, 1] + k[i];
    end for;
  end turns;
  parameter Winding w = Three();
  final parameter Real n[w.m] = turns(w);
  // expect: n[1] @ 1 = 4
  // expect: n[2] @ 1 = 7
  // expect: n[3] @ 1 = 9
end Run;
