//! Inputs of a class that it reads in its equations: what stands in for them is a variable that all these read instead.
//!
//! A heater that follows its command late is `C*der(T) = k*u - G*(T - T_0)` with another `u`: no equation gives it, so none can be opened
//! ([`crate::opening`]). The variable is what the input is until a modification says otherwise.

use std::ops::Range;

use hyd_source::{Files, Span};
use hyd_syntax::names::{Names, Purpose, names};
use hyd_syntax::tree::{ClassBody, ClassDef, ComponentRef, Element, Equation, EquationKind};
use hyd_syntax::visit::Role;

/// An input that is read by something else than by what only passes it on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ReadInput {
    /// Its name.
    pub name: String,
    /// Line of its declaration, from 1.
    pub line: u32,
}

/// Bytes of the text, and what is written there instead.
pub(crate) type TextEdit = (Range<usize>, String);

/// Those of the inputs that the class declares and reads outside of the texts of its commands ([`crate::commands`]).
pub fn read_inputs(text: &str, class: &str, inputs: &[String]) -> Vec<ReadInput> {
    let mut files = Files::new();
    let file = files.add("model", text);
    let parsed = hyd_syntax::parse(file, text);
    let all = names(&parsed.value, text);
    let Some(index) = index_of(&all, class) else { return Vec::new() };
    let passed: Vec<Range<usize>> = crate::commands(text, class).into_iter().map(|own| own.range).collect();
    let is_passed = |edit: &TextEdit| passed.iter().any(|own| own.start <= edit.0.start && edit.0.end <= own.end);
    let mut found = Vec::new();
    for name in inputs {
        let Some(span) = declared(&all.classes[index].def, name) else { continue };
        if readers(&all, index, text, (name, name)).is_some_and(|edits| !edits.iter().all(is_passed)) {
            found.push(ReadInput { name: name.clone(), line: files.location(span).line });
        }
    }
    found
}

/// The end of the name of the class that declares an input in a line, and what makes all that reads it read another variable; none if there is
/// no such input, or something reads it for which nothing can stand in.
pub(crate) fn edits(
    all: &Names,
    text: &str,
    files: &Files,
    (line, input): (u32, &str),
    stand_in: &str,
) -> Option<(usize, Vec<TextEdit>)> {
    let is_here = |class: &ClassDef| declared(class, input).is_some_and(|span| files.location(span).line == line);
    let index = all.classes.iter().position(|class| is_here(&class.def))?;
    let edits = readers(all, index, text, (input, stand_in))?;
    Some((all.classes[index].def.name.span.end as usize, edits))
}

/// Where a class stands among the names of its text.
fn index_of(all: &Names, class: &str) -> Option<usize> {
    hyd_source::dotted(class).try_fold(None, |around: Option<usize>, name| {
        let is_it = |own: &hyd_syntax::names::ClassPlace| own.parent == around && &*own.def.name.name == name;
        all.classes.iter().position(is_it).map(Some)
    })?
}

/// The name of a scalar that a class declares without giving it a value.
fn declared(class: &ClassDef, name: &str) -> Option<Span> {
    let ClassBody::Long { elements, .. } = &class.body else { return None };
    elements.iter().find_map(|element| match element {
        Element::Component(own)
            if &*own.name.name == name && own.dims.is_empty() && own.modification.binding.is_none() =>
        {
            Some(own.name.span)
        }
        _ => None,
    })
}

/// Every place of a class that reads an input with what is written there instead; none if something else is done with it.
fn readers(all: &Names, index: usize, text: &str, (input, stand_in): (&str, &str)) -> Option<Vec<TextEdit>> {
    let mut found = Vec::new();
    let mut connected = 0;
    for place in all.places.iter().filter(|place| place.class == Some(index) && &*place.ident.name == input) {
        let Purpose::Reference(part) = &place.purpose else { continue };
        if part.at > 0 || part.global || part.iterator.is_some() {
            continue;
        }
        match part.role {
            Role::Read if part.parts.len() == 1 => {
                found.push((place.ident.span.start as usize..place.ident.span.end as usize, stand_in.to_string()));
            }
            Role::Connected if part.parts.len() == 1 => connected += 1,
            _ => return None,
        }
    }
    let ClassBody::Long { equations, .. } = &all.classes[index].def.body else { return None };
    let sections = equations.iter().filter(|section| !section.initial);
    for Equation { kind, span, .. } in sections.flat_map(|section| &section.equations) {
        let EquationKind::Connect(one, other) = kind else { continue };
        let is_it = |end: &ComponentRef| matches!(&end.parts[..], [part] if &*part.name.name == input && part.subscripts.is_empty());
        let end = match (is_it(one), is_it(other)) {
            (true, false) => other,
            (false, true) => one,
            _ => continue,
        };
        // What is connected to an input is an input itself.
        let end = &text[end.span.start as usize..end.span.end as usize];
        found.push((span.start as usize..span.end as usize, format!("{end} = {stand_in}")));
        connected -= 1;
    }
    // In loops and conditions connections cannot be turned into equations.
    (connected == 0).then_some(found)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{ReadInput, read_inputs};
    use crate::opening::{Act, Opening, opened};

    fn opening(line: u32, input: &str) -> Opening {
        Opening {
            file: "model.mo".into(),
            line,
            equation: input.into(),
            name: "given".into(),
            words: "what u is given".into(),
            factor: String::new(),
            act: Act::StandsIn,
            elements: None,
        }
    }

    #[test]
    fn what_reads_an_input_reads_what_stands_in_for_it() {
        let text = "package P\nmodel M\n  input Real u;\n  RealInput w;\n  Real T(start = u);\n  Gain g(k = 2*u);\n  Real q[2] = {u*i for i in 1:2};\nequation\n  \
            der(T) = 3*u - T;\n  connect(w, g.u) annotation(Line(points = {{0, 0}, {1, 1}}));\n  for u in 1:2 loop\n    0 = u;\n  end for;\nend M;\nend P;\n";
        let inputs = ["u", "w", "x"].map(String::from);
        let expected = [("u", 3), ("w", 4)].map(|(name, line)| ReadInput { name: name.into(), line });
        assert_eq!(read_inputs(text, "P.M", &inputs), expected);
        let whole = opened(text, &[opening(3, "u")]).unwrap();
        for part in [
            "model M Real given = u \"what u is given\";",
            "start = given",
            "k = 2*given",
            "{given*i",
            "3*given - T",
            "    0 = u;",
        ] {
            assert!(whole.contains(part), "{part}: {whole}");
        }
        let whole = opened(text, &[opening(4, "w")]).unwrap();
        assert!(whole.contains("  g.u = given;") && whole.contains("3*u"), "{whole}");
        assert_eq!(opened(text, &[opening(5, "u")]), None);
    }

    #[test]
    fn what_only_passes_an_input_on_does_not_read_it() {
        let text = "model M\n  input Real u;\n  Real q;\n  Real T;\nequation\n  q = 3*u;\n  der(T) = q - T;\nend M;\n";
        assert!(read_inputs(text, "M", &["u".into()]).is_empty());
        let both = text.replace("q - T", "q - u*T");
        assert_eq!(read_inputs(&both, "M", &["u".into()]).len(), 1);
    }

    #[test]
    fn nothing_stands_in_where_an_input_is_connected_in_a_loop() {
        let text = "model M\n  RealInput u;\n  Gain g[2];\nequation\n  for i in 1:2 loop\n    connect(u, g[i].u);\n  end for;\nend M;\n";
        assert!(read_inputs(text, "M", &["u".into()]).is_empty());
    }
}
