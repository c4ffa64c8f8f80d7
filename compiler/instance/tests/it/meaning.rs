//! What names of a text mean, found from classes alone.

use hyd_instance::ClassTable;
use hyd_instance::meaning::Meaning;
use hyd_syntax::print_expr;

use crate::NoLibraries;

const TEXT: &str = "model M
  type Length = Real(unit = \"m\");
  model Part
    parameter Length size = 1;
  end Part;
  model Large
    extends Part(size = 5);
    Real extra;
  end Large;
  model Box
    replaceable model Inside = Part;
    Inside held;
    replaceable Part other;
  end Box;
  Box box(redeclare model Inside = Large, redeclare Large other(size = 7), held(size = 3));
  Real x(start = box.held.size);
equation
  x = box.held.extra + box.other.size + sum(k for k in 1:3) + nothing.here;
end M;
";

/// Of each name of the last lines: the line of its declaration, and its value as it is said outermost.
fn said() -> Vec<String> {
    let mut sources = NoLibraries;
    let mut table = ClassTable::new(&mut sources);
    let top = table.add_main("m.hyd", TEXT);
    let stored = hyd_syntax::parse(table.main.expect("added"), TEXT).value;
    let names = hyd_syntax::names::names(&stored, TEXT);
    let ids = table.ids_of(&names, &top);
    let from = TEXT.find("  Box box").expect("stands there") as u32;
    let places = names.places.iter().filter(|place| place.ident.span.start > from);
    let said = places.map(|place| {
        let meaning = table.meaning(place, &ids);
        let line =
            meaning.as_ref().and_then(|meaning| table.declared(meaning)).map(|span| table.files.location(span).line);
        let value = match &meaning {
            Some(Meaning::Component(member)) => table.given(member, None).map(|given| print_expr(&given.value)),
            _ => None,
        };
        let unit = match &meaning {
            Some(Meaning::Component(member)) => table.given(member, Some("unit")).map(|given| print_expr(&given.value)),
            _ => None,
        };
        let more: Vec<String> = value.into_iter().chain(unit).collect();
        let line = line.map_or("-".to_string(), |line| line.to_string());
        format!("{} {line} {}", place.ident.name, more.join(" ")).trim().to_string()
    });
    said.collect()
}

/// Redeclarations and modifications on the way to an element count, as they do for its instance (Modelica 3.6, section 7).
#[test]
fn names_mean_what_is_declared() {
    insta::assert_snapshot!(said().join("\n"), @r#"
    Box 10
    box 15
    Inside 11
    Large 6
    Large 6
    other 13
    size 4 7 "m"
    held 12
    size 4 3 "m"
    Real -
    x 16
    start -
    box 15
    held 12
    size 4 3 "m"
    x 16
    box 15
    held 12
    extra 8
    box 15
    other 13
    size 4 7 "m"
    sum -
    k 18
    k 18
    nothing -
    here -
    M 1
    "#);
}
