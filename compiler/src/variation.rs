//! A class copied under another name, with a further term in one of its equations.
//!
//! The copy stands by itself, in no package: it imports what the packages around the class hold, so that names in it mean what they
//! meant there (Modelica specification 3.6, section 13.2.1, unqualified imports).

use hyd_source::Files;
use hyd_syntax::head;
use hyd_syntax::tree::{ClassBody, ClassDef, Element, Equation, EquationKind, Expr, ExprKind};

use crate::opening::behind_description;

/// What the copy is to be.
#[derive(Clone, Debug)]
pub struct Variation<'a> {
    /// Line of the equation, from 1.
    pub line: u32,
    /// The equation, blanks as in [`crate::InjectionSite::text`].
    pub equation: &'a str,
    /// Name of the copy.
    pub name: &'a str,
    /// Its description.
    pub description: &'a str,
    /// What it declares beside what the class does, lines of its body.
    pub declarations: &'a str,
    /// What is added to the right side of the equation.
    pub term: &'a str,
    /// Sections of equations that it has beside those of the class, lines of its body; may be empty.
    pub sections: &'a str,
    /// What stands in its annotation.
    pub annotation: &'a str,
}

/// The text of the copy.  None where the equation is not found once, or where the class is partial or extends one of its own name.
pub fn varied(text: &str, variation: &Variation<'_>) -> Option<String> {
    let mut files = Files::new();
    let file = files.add("model", text);
    let parsed = hyd_syntax::parse(file, text);
    let mut found = Vec::new();
    let around = head(text).within;
    for class in &parsed.value.classes {
        holders(class, &around, (text, &files), variation, &mut found);
    }
    let [(class, around, right)] = &found[..] else { return None };
    let ClassBody::Long { extends_from: None, .. } = class.body else { return None };
    if class.partial {
        return None;
    }
    let Span { start, end } = Span::of(class.span);
    let mut edits: Vec<(Span, String)> = Vec::new();
    // From the name to the end of its description.
    let behind = behind_description(text, class.name.span.end as usize)?;
    let imports: String = (1..=around.len()).map(|k| format!("\n  import {}.*;", around[..k].join("."))).collect();
    let declarations: String = variation.declarations.lines().map(|line| format!("\n  {line}")).collect();
    let begin = format!("{} {}{imports}{declarations}", variation.name, crate::print_string(variation.description));
    edits.push((Span { start: class.name.span.start as usize, end: behind }, begin));
    let right = Span::of(right.span);
    let is_one = !matches!(found[0].2.kind, ExprKind::If(..));
    let (open, close) = if is_one { ("", "") } else { ("(", ")") };
    edits.push((right, format!("{open}{}{close} + {}", &text[right.start..right.end], variation.term)));
    if let Some(own) = class.annotation.as_ref().and_then(|own| own.span) {
        let keyword = text[..own.start as usize].rfind("annotation")?;
        let semicolon = own.end as usize + text[own.end as usize..].find(';')?;
        edits.push((Span { start: keyword, end: semicolon + 1 }, String::new()));
    }
    // The last word is the name of the class again.
    let tail = text[start..end].trim_end();
    let tail = start + tail.strip_suffix(&*class.name.name)?.len();
    let keyword = text[start..tail].trim_end().strip_suffix("end")?.len() + start;
    // As far in as the `end` of the class.
    let line = text[..keyword].rfind('\n').map_or(0, |at| at + 1);
    let indent = text[line..keyword].chars().take_while(|c| c.is_whitespace()).collect::<String>();
    let sections: String = variation.sections.lines().map(|line| format!("{indent}{line}\n")).collect();
    edits.push((
        Span { start: keyword, end },
        format!("{sections}  annotation({});\nend {}", variation.annotation, variation.name),
    ));
    edits.sort_by_key(|(span, _)| span.start);
    let mut copy = String::new();
    let mut at = start;
    for (span, put) in edits {
        copy.push_str(text.get(at..span.start)?);
        copy.push_str(&put);
        at = span.end;
    }
    Some(format!("{};\n", copy.trim_end()))
}

/// Bytes of a text.
#[derive(Clone, Copy)]
struct Span {
    start: usize,
    end: usize,
}

impl Span {
    fn of(span: hyd_source::Span) -> Self {
        Self { start: span.start as usize, end: span.end as usize }
    }
}

/// The classes that hold the equation, with the packages around each and the equation's right side.
fn holders<'a>(
    class: &'a ClassDef,
    around: &[String],
    (text, files): (&str, &Files),
    variation: &Variation<'_>,
    found: &mut Vec<(&'a ClassDef, Vec<String>, Expr)>,
) {
    let ClassBody::Long { elements, equations, .. } = &class.body else { return };
    let inside: Vec<String> = around.iter().cloned().chain([class.name.name.to_string()]).collect();
    for element in elements {
        if let Element::Class(nested) = element {
            holders(&nested.class, &inside, (text, files), variation, found);
        }
    }
    let blank = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let is_meant = |equation: &Equation| {
        files.location(equation.span).line == variation.line
            && blank(files.snippet(equation.span)) == variation.equation
    };
    for equation in equations.iter().filter(|section| !section.initial).flat_map(|section| &section.equations) {
        if let EquationKind::Equal(_, right) = &equation.kind
            && is_meant(equation)
        {
            found.push((class, around.to_vec(), right.clone()));
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Variation, varied};
    use crate::{Goal, Options, SourceText, Sources, compile};

    const LIBRARY: &str = "within Shop;
package Parts \"parts\"
  constant Real g = 9.81;
  type Force = Real(unit = \"N\");
  partial model Base
    Real v;
    Force f \"force\";
  end Base;
  model Drag
    \"drag, \" + \"linear\"
    extends Base;
    parameter Real d(unit = \"N.s/m\") = 2;
  equation
    f = if v > 0 then d*v else 2*d*v;
    annotation(Documentation(info = \"words; and more\"));
  end Drag;
end Parts;
";

    struct Shop;

    impl Sources for Shop {
        fn find(&mut self, path: &[std::sync::Arc<str>]) -> Result<Option<SourceText>, String> {
            let named = |name: &str, text: &str| Some(SourceText { name: name.into(), text: text.into() });
            let path: Vec<&str> = path.iter().map(|part| &**part).collect();
            Ok(match path[..] {
                ["Shop"] => named("Shop/package.mo", "package Shop\nend Shop;\n"),
                ["Shop", "Parts"] => named("Shop/Parts/package.mo", LIBRARY),
                _ => None,
            })
        }
    }

    #[test]
    fn a_copy_means_what_the_class_meant_and_has_the_term() {
        let line = LIBRARY.lines().position(|line| line.contains("f = if")).unwrap() as u32 + 1;
        let variation = Variation {
            line,
            equation: "f = if v > 0 then d*v else 2*d*v",
            name: "Own",
            description: "a \"law\"",
            declarations: "parameter Real c = 0.5 \"coefficient\";",
            term: "c*g*v*abs(v)",
            sections: "",
            annotation: "__hyd(note = \"x\")",
        };
        let copy = varied(LIBRARY, &variation).unwrap();
        assert_eq!(
            copy,
            "model Own \"a \\\"law\\\"\"
  import Shop.*;
  import Shop.Parts.*;
  parameter Real c = 0.5 \"coefficient\";
    extends Base;
    parameter Real d(unit = \"N.s/m\") = 2;
  equation
    f = (if v > 0 then d*v else 2*d*v) + c*g*v*abs(v);
    
    annotation(__hyd(note = \"x\"));
end Own;
"
        );
        let text = format!("{copy}model Use\n  Own own;\nequation\n  own.v = -3;\nend Use;\n");
        let options = Options { model: Some("Use".into()), set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
        let made = compile(&mut Shop, "use.mo", &text, &options);
        assert!(!made.has_errors(), "{copy}{:?}", made.diagnostics);
        // With a state of its own.
        let lagging = Variation {
            declarations: "parameter Real T = 0.5;\nReal z;",
            term: "d*z",
            sections: "initial equation\n  z = v;\nequation\n  T*der(z) = v - z;",
            ..variation.clone()
        };
        let copy = varied(LIBRARY, &lagging).unwrap();
        assert!(copy.contains("  T*der(z) = v - z;\n  annotation(__hyd(note"), "{copy}");
        let made =
            compile(&mut Shop, "use.mo", &format!("{copy}{}", text.split_once("end Own;\n").unwrap().1), &options);
        assert!(!made.has_errors(), "{copy}{:?}", made.diagnostics);
        // Of two like equations in one line none is meant.
        let twice = "model A\n  Real x;\nequation\n  x = 1; x = 1;\nend A;\n";
        assert_eq!(varied(twice, &Variation { line: 4, equation: "x = 1", ..variation }), None);
    }
}
