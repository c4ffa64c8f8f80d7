//! The types of expressions: Modelica 3.6, section 6.7 and chapter 10.

use crate::check_typed;

#[test]
fn numbers_join_to_real() {
    let body = "  Integer n;
  Real x, y, z;
  Boolean b;
equation
  n = 2*3 - 1;
  x = n*2.5;
  y = n/2;
  z = if b then n else x;
  b = n > 1 and x <= y;";
    insta::assert_snapshot!(check_typed(body), @r"
    n: Integer = ((2: Integer * 3: Integer): Integer - 1: Integer): Integer
    x: Real = (n: Integer * 2.5: Real): Real
    y: Real = (n: Integer / 2: Integer): Real
    z: Real = (if b: Boolean then n: Integer else x: Real): Real
    b: Boolean = ((n: Integer > 1: Integer): Boolean and (x: Real <= y: Real): Boolean): Boolean
    ");
}

/// Subscripts take dimensions away, slices keep them.
#[test]
fn dimensions_follow_from_subscripts() {
    let body = "  Real a[2, 3], v[3], w[2], s;
equation
  v = a[1, :];
  w = a[:, end];
  s = a[2, 1];
  a[1:2, 2] = w;";
    insta::assert_snapshot!(check_typed(body), @r"
    v: Real[:] = a[1: Integer, :]: Real[:]
    w: Real[:] = a[:, end: Integer]: Real[:]
    s: Real = a[2: Integer, 1: Integer]: Real
    a[(1: Integer:2: Integer): Integer[:], 2: Integer]: Real[:] = w: Real[:]
    ");
}

/// Products, transposed and put together.
#[test]
fn dimensions_of_products_and_array_functions() {
    let body = "  Real a[2, 3], v[3], w[2], s, m[3, 3];
equation
  w = a*v;
  s = v*v;
  m = transpose(a)*a + identity(3);
  v = cat(1, w, {1});
  m = outerProduct(v, v) + [a; w*a];
  s = sum(a) + max(v) + size(a, 1) + ndims(a);
  v = {i^2 for i in 1:3};";
    insta::assert_snapshot!(check_typed(body), @r"
    w: Real[:] = (a: Real[:, :] * v: Real[:]): Real[:]
    s: Real = (v: Real[:] * v: Real[:]): Real
    m: Real[:, :] = ((transpose(a: Real[:, :]): Real[:, :] * a: Real[:, :]): Real[:, :] + identity(3: Integer): Integer[:, :]): Real[:, :]
    v: Real[:] = cat(1: Integer, w: Real[:], {1: Integer}: Integer[:]): Real[:]
    m: Real[:, :] = (outerProduct(v: Real[:], v: Real[:]): Real[:, :] + [a: Real[:, :]; (w: Real[:] * a: Real[:, :]): Real[:]]: Real[:, :]): Real[:, :]
    s: Real = (((sum(a: Real[:, :]): Real + max(v: Real[:]): Real): Real + size(a: Real[:, :], 1: Integer): Integer): Real + ndims(a: Real[:, :]): Integer): Real
    v: Real[:] = {(local i: Integer ^ 2: Integer): Real for i in (1: Integer:3: Integer): Integer[:]}: Real[:]
    ");
}

/// Which functions keep Integers, and which give Booleans.
#[test]
fn functions_of_the_language_have_their_types() {
    let body = "  Integer n;
  Real x(start = 1);
  Boolean b;
equation
  n = abs(n) + mod(n, 3) + integer(x) + sign(x);
  der(x) = sqrt(n) + max(n, x) + noEvent(x) + delay(x, 1);
  b = edge(b) or initial() or sample(0, 1);";
    insta::assert_snapshot!(check_typed(body), @r"
    n: Integer = (((abs(n: Integer): Integer + mod(n: Integer, 3: Integer): Integer): Integer + integer(x: Real): Integer): Integer + sign(x: Real): Integer): Integer
    der(x: Real): Real = (((sqrt(n: Integer): Real + max(n: Integer, x: Real): Real): Real + noEvent(x: Real): Real): Real + delay(x: Real, 1: Integer): Real): Real
    b: Boolean = ((edge(b: Boolean): Boolean or initial(): Boolean): Boolean or sample(0: Integer, 1: Integer): Boolean): Boolean
    ");
}
