//! Messages for faulty texts: each case is a text and all it must produce, as `code line:column message` with the other
//! marked places and the notes below.  The expected lines were checked by hand against the place of the mistake.

use super::said::check;

#[test]
fn a_missing_semicolon_names_the_line_before() {
    check(
        "model M
  Real x(start = 1, fixed = true)
  Real v;
equation
  x = 1
  v = 2;
end M;
",
        "E0101 2:34 expected `;` after this declaration, found `Real`
  at 3:3 this begins something new
E0101 5:8 expected `;` after this equation, found `v`
  at 6:3 this begins something new",
    );
}

#[test]
fn a_missing_operator_is_a_missing_semicolon_in_the_same_line() {
    check(
        "model M
  Real d = 2 x;
end M;
",
        "E0101 2:13 expected `;` after this declaration, found `x`
  at 2:14 this begins something new
  note: multiplication is written with `*`",
    );
}

#[test]
fn missing_ends_name_the_class() {
    check(
        "package P
  model A
    Real x;
end P;
",
        "E0101 2:9 `end A;` is missing before `end P;`
  at 4:1 it must end before this",
    );
}

#[test]
fn missing_ends_at_the_end_of_the_file() {
    check(
        "package P
  model A
    Real x;
",
        "E0101 1:9 `end P;` is missing at the end of the file
E0101 2:9 `end A;` is missing at the end of the file",
    );
}

#[test]
fn a_class_after_equations_shows_a_missing_end() {
    check(
        "package P
  model A
  equation
    x = 1;
  model B
  end B;
end P;
",
        "E0101 2:9 `end A;` is missing before the class `B`
  at 5:9 it must end before this",
    );
}

#[test]
fn a_class_among_equations_is_too_late() {
    check(
        "model A
equation
  x = 1;
  model B
  end B;
end A;
",
        "E0101 4:9 the class `B` cannot be declared in an equation or algorithm section
  note: put it before `equation`",
    );
}

#[test]
fn a_wrong_end_name() {
    check(
        "model Pump
  Real x;
end Pmup;
",
        "E0104 3:5 the class is called `Pump`, but its end says `Pmup`
  at 1:7 the class begins here
  note: did you mean `Pump`?",
    );
}

#[test]
fn a_missing_end_name() {
    check(
        "model Pump
  Real x;
end;
",
        "E0104 3:1 the name of the class is missing after `end`: `end Pump;`
  at 1:7 the class begins here",
    );
}

#[test]
fn an_end_too_many() {
    check(
        "model A
end A;
end A;
",
        "E0101 3:1 `end A` closes nothing: no class is open here",
    );
}

#[test]
fn keywords_are_no_names() {
    check(
        "model M
  Real input;
  parameter Real model = 3;
end M;
model block
  Real y;
end block;
",
        "E0101 2:8 `input` is a keyword and cannot be a name
  note: choose another name, such as `input_`, or quote it: `'input'`
E0101 3:18 `model` is a keyword and cannot be a name
  note: choose another name, such as `model_`, or quote it: `'model'`
E0101 5:7 `block` is a keyword and cannot be a name
  note: choose another name, such as `block_`, or quote it: `'block'`",
    );
}

#[test]
fn a_string_without_end() {
    check(
        r#"model M
  Real x "text;
  Real y;
end M;
"#,
        r#"E0101 2:10 this string has no end: a closing `"` is missing"#,
    );
}

#[test]
fn a_string_that_ends_too_late() {
    check(
        r#"model M
  Real x "text;
  Real y "more";
end M;
"#,
        r#"E0101 3:15 this string has no end: a closing `"` is missing
  at 2:10 this string goes on over several lines; its end may be missing"#,
    );
}

#[test]
fn a_comment_without_end() {
    check(
        "model M
  Real x;
  /* comment
end M;
",
        "E0101 3:3 this comment has no end: `*/` is missing",
    );
}

#[test]
fn foreign_characters() {
    check(
        "model M
  Real größe;
  Real y = 3 − 2;
end M;
",
        "E0101 2:8 `ö` cannot stand in a name
  note: names consist of the letters A to Z and a to z, digits and `_`; other characters need single quotes: 'größe'
E0101 3:14 the character `−` has no meaning in Modelica
  note: minus is the plain character `-`",
    );
}

#[test]
fn operators_of_other_languages() {
    check(
        "model M
  Boolean b = x && y != z;
  Real f = 2**3;
end M;
",
        "E0101 2:17 the character `&` has no meaning in Modelica
  note: write `and`
E0101 2:22 the character `!` has no meaning in Modelica
  note: write `<>`
E0101 3:14 expected an expression, found `*`
  note: powers are written with `^`",
    );
}

#[test]
fn text_after_the_last_class() {
    check(
        "model M
end M;
Real x;
foo bar;
",
        "E0101 3:1 this stands outside of any class, after `end M;`
  note: a file consists of classes: `model Name ... end Name;`",
    );
}

#[test]
fn comparison_and_assignment_instead_of_an_equation() {
    check(
        "model M
equation
  x == 1;
  x := 2;
  x;
  Real y;
end M;
",
        "E0101 3:5 `==` compares two values; an equation is written with `=`
  note: write `a = b`
E0101 4:5 `:=` cannot stand in an equation
  note: equations are written with `=`; assignments with `:=` belong into an `algorithm` section
E0101 5:4 expected `=`, found `;`
E0101 6:8 expected `=`, found `y`
  note: declarations such as `Real x;` stand before `equation`",
    );
}

#[test]
fn equations_in_algorithms() {
    check(
        "model M
algorithm
  x = 2;
  x == 2;
  connect(a, b);
  f(x) := 3;
  (a, b) := c;
end M;
",
        "E0101 3:5 `=` cannot stand in an algorithm
  note: assignments are written with `:=`; equations belong into an `equation` section
E0101 4:5 `==` compares two values; an assignment is written with `:=`
  note: write `a := b`
E0101 5:3 `connect` can stand only in an `equation` section
E0101 6:3 only a name, such as `x` or `a.b[1]`, can be assigned to
E0101 7:13 a list of results can only be assigned from a function call",
    );
}

#[test]
fn statements_in_equations() {
    check(
        "model M
equation
  while a loop
    x = 1;
  end while;
  return;
end M;
",
        "E0101 3:3 `while` can stand only in an `algorithm` section
E0101 6:3 `return` can stand only in an `algorithm` section",
    );
}

#[test]
fn equations_among_declarations() {
    check(
        "model M
  Real x;
  x = 1;
  der(x) = 2;
  connect(a, b);
end M;
",
        "E0101 3:3 an equation cannot stand among the declarations
  note: equations follow the word `equation`
E0101 4:3 an equation cannot stand among the declarations
  note: equations follow the word `equation`
E0101 5:3 an equation cannot stand among the declarations
  note: equations follow the word `equation`",
    );
}

#[test]
fn declarations_among_equations() {
    check(
        "model M
equation
  parameter Real y = 2;
end M;
",
        "E0101 3:3 a declaration cannot stand among equations or statements
  note: declarations stand before `equation` and `algorithm`",
    );
}

#[test]
fn else_if_in_two_words() {
    check(
        "model M
equation
  if a then
    x = 1;
  else if b then
    x = 2;
  end if;
end M;
",
        "E0101 3:3 this `if` is not closed: `end if;` is missing
  note: `else if` begins a new `if` with an `end if;` of its own; write `elseif` as one word",
    );
}

#[test]
fn blocks_closed_by_the_wrong_end() {
    check(
        "model M
equation
  for i in 1:3 loop
    x[i] = 1;
  end if;
  elsewhen c then
  end when;
end M;
",
        "E0101 5:3 expected `end for`, found `end if`
  at 3:3 this `for` is open
E0101 6:3 `elsewhen` without `when` before it
E0101 7:3 `end when` closes nothing: no `when` is open here",
    );
}

#[test]
fn broken_block_heads() {
    check(
        "model M
equation
  for i 1:3 loop
    x[i] = 1;
  end for;
  if a = b then
    y = 1;
  end if;
  if a > b x = 1;
  end if;
end M;
",
        "E0101 3:9 expected `,`, `in` or `loop`, found `1`
E0101 6:8 expected `then` or an operator, found `=`
  note: values are compared with `==`
E0101 9:12 expected `then` or an operator, found `x`",
    );
}

#[test]
fn broken_class_heads() {
    check(
        "model 3M
  Real x;
end 3M;
model A;
  Real x;
end A;
",
        "E0101 1:7 expected a name, found `3M`
  note: names begin with a letter or `_`
E0101 4:8 this `;` ends nothing
  note: the first line of a class has no `;`: `model Name`",
    );
}
