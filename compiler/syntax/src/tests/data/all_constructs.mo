within Hyd.Tests;
encapsulated package 'all constructs' "Every construct" + " of the grammar once"
  import Modelica.Units.SI;
  import C = Modelica.Constants;
  import Modelica.Math.*;
  import Hyd.Units.{Pressure, Volume};
  type Length = Real(final unit = "m", min = 0) "A length" annotation(Evaluate = true);
  type Mode = enumeration(off "Not running", on);
  type Any = enumeration(:);
  connector RealInput = input Real;
  function f_x = der(f, x);
  expandable connector Bus
  end Bus;
  operator record Complex
    Real re;
  end Complex;
  function f "quoted \" and \\ and \n"
    input Real x[:];
    input Real y = 2;
    output Real z;
  protected
    Integer k(start = 0);
  algorithm
    k := 1;
    (z, , k) := g(x, y = 3);
    for i in 1:2:size(x, 1), j loop
      z := z + x[i]^2;
      if z > 3 then
        break;
      elseif z < -3 then
        return;
      else
        z := 0;
      end if;
    end for;
    while k < 3 and not z > 1 loop
      k := k + 1;
    end while;
    assert(z > 0, "negative");
  end f;
  impure function h
    external "C" z = h_c(1) annotation(Library = "h");
  end h;
  replaceable partial model Base
    outer Real w;
  end Base constrainedby Any;
  model extends Old(x = 1)
    Real n;
  end Old;
  model M
    extends Base(redeclare replaceable model A = B(each x = 1) constrainedby C, each final a.b(start = 1) = 2, redeclare Real q[3] = {1, 2, 3});
    replaceable model Law = P.Q(k = 1) constrainedby R(k = 2) "law";
    final parameter Real a[2, 3] = [1, 2, 3; 4, 5, 6], b(unit = "1") = 1. "b" annotation(Dialog(group = "g", enable = a[1, 1] > 0));
    Real[3] x[2](each start = 1e-3) if true;
    inner replaceable flow Real y constrainedby Real;
    .Modelica.Units.SI.Mass m;
  public
    discrete input Integer n;
  initial equation
    x[1, 1] = 0;
  initial algorithm
    n := 1;
  equation
    connect(a.p[1], b.n) "wire" annotation(Line(points = {{0, 0}, {1, 1}}));
    a[:, end] = {i^2 for i in 1:3, j in 1:2};
    y = sum(x[i, 1] for i in 1:2) + (if a then b elseif c then d else e);
    (p, q) = f(x, y = -2^2);
    for i loop
      when {initial(), sample(0, 1)} then
        reinit(x, pre(x) .* 2 ./ 3 .^ 4 .+ 5 .- 6);
      elsewhen b then
        terminate("done");
      end when;
    end for;
    if a then
      x = 1;
    elseif not b or c <> d then
      x = 2;
    else
      x = der(y);
    end if;
    /* block
       comment */ // and a line comment
    annotation(experiment(StopTime = 1), Icon(graphics = {Text(textString = "%name")}));
  end M;
end 'all constructs';
