//! Whole files: models of all kinds are read without a message, and the one with a mistake gives the message it should.

use hyd_source::{FileId, Files, Outcome};

use crate::tree::{ClassBody, Element, StoredDefinition};

fn parse(text: &str) -> Outcome<StoredDefinition> {
    crate::parse(FileId(0), text)
}

/// (equations, components, nested classes) of all classes of a file.
fn counts(definition: &StoredDefinition) -> (usize, usize, usize) {
    let mut total = (0, 0, 0);
    let mut pending: Vec<_> = definition.classes.clone();
    while let Some(class) = pending.pop() {
        let ClassBody::Long { elements, equations, .. } = &class.body else { continue };
        total.0 += equations.iter().map(|section| section.equations.len()).sum::<usize>();
        for element in elements {
            match element {
                Element::Component(_) => total.1 += 1,
                Element::Class(nested) => {
                    total.2 += 1;
                    pending.push(nested.class.clone());
                }
                _ => {}
            }
        }
    }
    total
}

/// The counts were taken by hand from the texts.
#[test]
fn models_are_read_completely() {
    let cases = [
        ("amplifier", include_str!("data/amplifier.mo"), (50, 41, 9)),
        ("redeclared_controller", include_str!("data/redeclared_controller.mo"), (5, 15, 8)),
        ("thermostat", include_str!("data/thermostat.mo"), (3, 10, 0)),
        ("shared_field", include_str!("data/shared_field.mo"), (6, 20, 6)),
    ];
    for (name, text, expected) in cases {
        let outcome = parse(text);
        assert!(outcome.diagnostics.is_empty(), "{name}: {:?}", outcome.diagnostics);
        assert_eq!(counts(&outcome.value), expected, "{name}");
    }
}

#[test]
fn long_equations_and_every_construct_are_read() {
    for text in [include_str!("data/seven_bodies.mo"), include_str!("data/all_constructs.mo")] {
        let outcome = parse(text);
        assert!(outcome.diagnostics.is_empty(), "{:?}", outcome.diagnostics);
        assert_eq!(outcome.value.classes.len(), 1);
    }
}

#[test]
fn a_missing_semicolon_is_reported_in_its_line() {
    let text = include_str!("data/missing_semicolon.mo");
    let mut files = Files::new();
    let file = files.add("missing_semicolon.mo", text);
    let outcome = crate::parse(file, text);
    let [only] = outcome.diagnostics.as_slice() else { panic!("one message expected: {:?}", outcome.diagnostics) };
    assert_eq!(only.message, "expected `;` after this declaration, found `Real`");
    assert_eq!(files.location(only.labels[0].span).line, 4);
    // Nothing of the model is lost.
    assert_eq!(counts(&outcome.value), (2, 3, 0));
}

#[test]
fn spans_cover_the_text_of_a_declaration_and_of_an_equation() {
    let text = "model M\n  parameter Real a = 1 , b( start=2 ) ;\nequation\n  a = b + 1 ;\nend M;";
    let mut files = Files::new();
    let file = files.add("m.mo", text);
    let outcome = crate::parse(file, text);
    let ClassBody::Long { elements, equations, .. } = &outcome.value.classes[0].body else { panic!("long class") };
    let spans: Vec<&str> = elements
        .iter()
        .map(|element| match element {
            Element::Component(component) => files.snippet(component.span),
            _ => "",
        })
        .collect();
    assert_eq!(spans, ["parameter Real a = 1", "b( start=2 )"]);
    assert_eq!(files.snippet(equations[0].equations[0].span), "a = b + 1");
    assert_eq!(files.snippet(outcome.value.classes[0].span), text.trim_end_matches(';'));
}
