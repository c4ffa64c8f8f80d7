//! Messages for faulty expressions, prefixes, brackets and ends of texts; in the form of `messages.rs`.

use super::said::check;

#[test]
fn signs_relations_and_powers_do_not_chain() {
    check(
        "model M
  Real a = b*-c;
  Real b = a < b < c;
  Real c = a^b^c;
  Real g = 1 + not b;
  Real r = 1:2:3:4;
end M;
",
        "E0101 2:14 the sign `-` cannot follow another operator
  note: put it in parentheses: `(-a)`
E0101 3:18 a comparison cannot be followed by another one: unexpected `<`
  note: write `a < b and b < c`
E0101 4:15 powers cannot be chained: unexpected `^`
  note: use parentheses: `(a^b)^c` or `a^(b^c)`
E0101 5:16 `not` cannot stand here
  note: put it in parentheses: `(not a)`
E0101 6:17 a range has at most three parts: `start : step : stop`",
    );
}

#[test]
fn broken_expressions() {
    check(
        "model M
  Real e = .5;
  Real h = 1 + if a then 2 else 3;
  Real i = (1 + 2;
  Real j = {};
  Real m[3 = 2;
end M;
",
        "E0101 2:12 a number cannot begin with `.`
  note: write `0.5`
E0101 3:16 expected an expression, found `if`
  note: an `if` expression inside an expression needs parentheses: `(if c then a else b)`
E0101 4:18 expected `,`, `)` or an operator, found `;`
  at 4:12 this bracket is still open
E0101 5:12 an array constructor needs at least one element
  note: an empty array is written `fill(0.0, 0)`
E0101 6:12 expected `,`, `]` or an operator, found `=`",
    );
}

/// Lists of annotations are data.
#[test]
fn lists_in_annotations_may_be_empty() {
    check(
        "model M
  Real a = 1 annotation(__hyd(scales = {}));
  Real b[0] = {} annotation(Dialog(group = {}));
  annotation(__hyd(effect(rivals = {}, at = {{}, {1}})));
end M;
",
        "E0101 3:15 an array constructor needs at least one element
  note: an empty array is written `fill(0.0, 0)`",
    );
}

#[test]
fn brackets_that_do_not_fit() {
    check(
        "model M
  Real n = f(a, 2];
  Real y(start = 1;
  Real z;
end M;
",
        "E0101 2:18 expected `,`, `)` or an operator, found `]`
E0101 3:19 expected `,`, `)` or an operator, found `;`
  at 3:9 this bracket is still open",
    );
}

#[test]
fn several_mistakes_in_one_run() {
    check(
        "model M
equation
  x = * 2;
  y = 1;
  z = )3;
  w = 2;
  a = b
  -c = d;
  x += 1;
end M;
",
        "E0101 3:7 expected an expression, found `*`
E0101 5:7 expected an expression, found `)`
E0101 8:6 expected `;` or an operator, found `=`
  note: a `;` may be missing at the end of a line before
E0101 9:6 expected an expression, found `=`
  note: write `x = x + 1` in full",
    );
}

#[test]
fn prefixes_out_of_order() {
    check(
        "model M
  parameter final Real x;
  flow flow Real y;
  input output Real z;
end M;
",
        "E0101 2:13 `final` must stand before `parameter`
E0101 3:8 `flow` stands here twice
E0101 4:9 `input` and `output` exclude each other",
    );
}

#[test]
fn the_text_ends_in_a_declaration() {
    check(
        "model M
  Real x =",
        "E0101 1:7 `end M;` is missing at the end of the file
E0101 2:11 expected an expression, found the end of the file",
    );
}

#[test]
fn outside_of_the_profile() {
    check(
        "model M
  extends A(break x);
  Real y = f(function g(1));
end M;
",
        "E0102 2:13 leaving out inherited elements (`break`) is outside the language profile
E0101 3:25 a function as an argument is given its inputs by name: `function f(a = 1)`",
    );
}

#[test]
fn numbers_too_large() {
    check(
        "model M
  Integer i = 9223372036854775808;
  Real x = 1e999;
end M;
",
        "E0101 2:15 the Integer `9223372036854775808` is larger than 9223372036854775807
  note: write it as a Real, with a decimal point
E0101 3:12 the number `1e999` is too large for a Real",
    );
}

#[test]
fn end_outside_of_an_index() {
    check(
        "model M
  Real x = end + 1;
  Real y = a[end];
end M;
",
        "E0101 2:12 `end` as a value has a meaning only in an index, such as `x[end]`",
    );
}

#[test]
fn one_annotation_per_class() {
    check(
        "model M
  annotation(a = 1);
  annotation(b = 1);
end M;
",
        "E0101 3:3 a class has only one annotation
  note: put all entries into one `annotation(...)`",
    );
}
