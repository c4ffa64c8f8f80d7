// `:` takes its size from a value that only the run knows (Modelica 3.6, chapter 10).
function twice
  input Real v[:];
  input Integer n = 2;
  output Real w[n*size(v, 1)];
algorithm
  for i in 1:n loop
    w[(i - 1)*size(v, 1) + 1:i*size(v, 1)] := v;
  end for;
end twice;
function scalar_of
  input Real x;
  output Real y = 2*x;
end scalar_of;
record R
  Real x;
end R;
model Run
  Real a[2] = {time, 2};
  Real m[2, 3] = time*ones(2, 3);
  Real e[:] = cat(1, a, {1, 2});
  Real f[:] = a;
  Real g[:, :] = transpose(m);
  Real h[:] = m*{1, 2, 3} + a[1:2];
  Real i[:, :] = [a, a; 1, time];
  Real j[:] = {u*time for u in 1:5};
  Real k[:] = twice(a, 3);
  Real l[:] = scalar_of(a);
  Real n[:] = if time > 0.5 then a else {5, 6};
  Real o[:] = m[1, 2:end];
  Real p[:, :] = m[{2, 1}, :] .+ 1;
  Real q[:] = abs(-a);
  R r[:] = {R(time), R(2)};
  Real s[size(cat(1, a, a), 1)] = fill(time, 4);
  // expect: e[4] @ 1 = 2
  // expect: f[1] @ 1 = 1
  // expect: g[3,2] @ 1 = 1
  // expect: h[2] @ 1 = 8
  // expect: i[3,2] @ 1 = 1
  // expect: i[2,1] @ 1 = 2
  // expect: j[5] @ 1 = 5
  // expect: k[6] @ 1 = 2
  // expect: l[2] @ 1 = 4
  // expect: n[2] @ 1 = 2
  // expect: o[2] @ 1 = 1
  // expect: p[2,3] @ 1 = 2
  // expect: q[2] @ 1 = 2
  // expect: r[1].x @ 1 = 1
  // expect: s[4] @ 1 = 1
end Run;
