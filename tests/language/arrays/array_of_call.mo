// `array(a, b)` is `{a, b}`, and `array(e for i in r)` is `{e for i in r}`.
package P
  function f
    input Real x[:];
    output Real y;
  algorithm
    y := sum(array(2*x[i] for i in 1:size(x, 1)));
  end f;
end P;
model Run
  parameter Integer n = 3;
  parameter Real v[n] = array(2*k for k in 1:n);
  parameter Real m[:, :] = array(i + 10*j for i in 1:2, j in 1:n);
  parameter Real w[:] = array(1, 2, n);
  constant Integer count = size(array(k for k in 1:4), 1);
  Real x = time*sum(v);
  Real of_run[n] = array(k*time for k in 1:n);
  Real matrix[2, 2] = array(array(1, time), {3, 4});
  Real y = P.f(array(time, 2, 3));
  Real z;
equation
  z = sum(array(of_run[k] for k in {1, 3}));
  // expect: x @ 1 = 12
  // expect: m[3,2] @ 0 = 32
  // expect: w[3] @ 0 = 3
  // expect: count @ 0 = 4
  // expect: of_run[2] @ 1 = 2
  // expect: matrix[1,2] @ 1 = 1
  // expect: matrix[2,1] @ 1 = 3
  // expect: y @ 1 = 12
  // expect: z @ 1 = 4
end Run;
