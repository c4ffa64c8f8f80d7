// A number that an operator of the record converts, within a loop: the conversion is not taken for the operator's result.
operator record Cx
  Real re; Real im;
  encapsulated operator 'constructor'
    function fromReal
      import Cx;
      input Real re; input Real im = 0;
      output Cx result(re = re, im = im);
    algorithm
    end fromReal;
  end 'constructor';
  encapsulated operator function '/'
    import Cx;
    input Cx a; input Cx b;
    output Cx c;
  algorithm
    c := Cx((a.re*b.re + a.im*b.im)/(b.re^2 + b.im^2), (-a.re*b.im + a.im*b.re)/(b.re^2 + b.im^2));
    annotation(Inline = true);
  end '/';
end Cx;
function total
  input Cx v[:];
  output Cx result;
algorithm
  result := Cx(sum(v[:].re), sum(v[:].im));
  annotation(Inline = true);
end total;
model Run
  Real f = 2*time;
  Cx s = total({1/Cx(k, f) for k in 1:2});
  Cx t = total({Cx(1)/Cx(k, f) for k in 1:2});
  Cx u = total({1/Cx(1, f), 1/Cx(2, f)});
  Real x = s.re; // 1/(1 + 2i) + 1/(2 + 2i)
  Real y = s.im;
  Real z = abs(s.re - t.re) + abs(s.re - u.re) + abs(s.im - t.im) + abs(s.im - u.im);
  // expect: x @ 1 = 0.45
  // expect: y @ 1 = -0.65
  // expect: z @ 1 = 0
end Run;
