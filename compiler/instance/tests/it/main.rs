//! Texts to instances: what the tree holds, by subject.

mod meaning;

use std::sync::Arc;

use hyd_instance::{ClassTable, Override, SourceText, Sources};

/// No libraries.
struct NoLibraries;

impl Sources for NoLibraries {
    fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        Ok(None)
    }
}

/// The printed instance tree of the last class of a text with values set from outside, and what was said.
fn check_set(text: &str, set: &[(&str, &str)]) -> String {
    let mut sources = NoLibraries;
    let mut table = ClassTable::new(&mut sources);
    let classes = table.add_main("m.hyd", text);
    let class = *classes.last().expect("the text has a class");
    let value = |&(path, text): &(&str, &str)| Override { path: path.into(), text: text.into(), used: false };
    let (printed, said) = match hyd_instance::instantiate(table, class, set.iter().map(value).collect()) {
        Ok((_, scopes)) => {
            assert_eq!(scopes.verify(), Ok(()));
            (scopes.to_string(), scopes.table.messages.into_given())
        }
        Err(table) => (String::new(), table.messages.into_given()),
    };
    said.into_iter().fold(printed, |text, said| text + "said: " + &said.message + "\n")
}

fn check(text: &str) -> String {
    check_set(text, &[])
}

/// An array of components is one instance with sizes, however many elements it has.
#[test]
fn arrays_of_components_stay_one_instance() {
    let text = "model M
  parameter Integer n = 2 + size(c, 1);
  model Part
    Real x[2];
  end Part;
  Part c[3];
  Real y[n, 2];
end M;";
    insta::assert_snapshot!(check(text), @r"
    .: model M
      n: Integer
      c[3]: model M.Part
        x[2]: Real
      y[5, 2]: Real
    ");
}

/// A size asks for a parameter, which a value from outside decides.
#[test]
fn sizes_follow_values_set_from_outside() {
    let text = "model M
  parameter Integer n = 2;
  Real x[n];
  Real z if n > 2;
end M;";
    insta::assert_snapshot!(check(text), @r"
    .: model M
      n: Integer
      x[2]: Real
      z: ? (absent)
    ");
    insta::assert_snapshot!(check_set(text, &[("n", "4")]), @r"
    .: model M
      n: Integer
      x[4]: Real
      z: Real
    ");
}

/// The outermost modification counts, `redeclare` changes the class (Modelica 3.6, sections 7.2 and 7.3).
#[test]
fn modifications_and_redeclarations() {
    let text = "model M
  model Spring
    parameter Real k = 1;
  end Spring;
  model Hard
    extends Spring(k = 2);
    Real extra;
  end Hard;
  model Box
    replaceable Spring s;
    Real v[size(w, 1)];
    parameter Real w[:] = {1};
  end Box;
  Box a;
  Box b(redeclare Hard s, w = {1, 2, 3});
end M;";
    insta::assert_snapshot!(check(text), @r"
    .: model M
      a: model M.Box
        s: model M.Spring
          k: Real
        v[1]: Real
        w[1]: Real
      b: model M.Box
        s: model M.Hard
          k: Real
          extra: Real
        v[3]: Real
        w[3]: Real
    ");
}

/// `outer` is the `inner` one of what is around it (section 5.4).
#[test]
fn outer_components_are_the_inner_one() {
    let text = "model M
  model World
    parameter Real g = 9.81;
  end World;
  model Body
    outer World world;
    Real f = world.g;
  end Body;
  inner World world(g = 1.62);
  Body b;
end M;";
    insta::assert_snapshot!(check(text), @r"
    .: model M
      world: model M.World
        g: Real
      b: model M.Body
        f: Real
    ");
}

/// Values that need each other, and classes that hold themselves, end in messages.
#[test]
fn cycles_are_told() {
    let sizes = "model M
  parameter Integer a = b;
  parameter Integer b = a;
  Real x[a];
end M;";
    insta::assert_snapshot!(check(sizes), @r"
    .: model M
      a: Integer
      b: Integer
      x: ?
    said: the value of `a` depends on itself
    ");
    let classes = "model M
  M inside;
end M;";
    insta::assert_snapshot!(check(classes), @r"
    .: model M
      inside: type M
    said: `M` contains a component of its own class
    ");
}
