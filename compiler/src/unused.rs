//! Parameters that are declared and used nowhere: where an equation is missing or a run fails, what needs them may have been left out.

use hyd_source::{Code, Diagnostic, Files, Severity};
use hyd_syntax::tokens::{Kind, tokens};
use hyd_syntax::tree::{ClassBody, ClassDef, ClassKind, Element, Variability};

/// Of more parameters than these none is named: a text with many of them is a table of data.
const MOST: usize = 2;
/// What is said of a start that takes start values which nobody fixed.
const OPEN_START: &str = "the start is not fully determined";

/// A sentence on parameters of the models of a text that occur in their declarations alone; none where there are none, or many.
pub fn unused_parameters(files: &Files, name: &str) -> Option<String> {
    let file = files.ids().find(|&id| files.name(id).as_ref() == name)?;
    let text = files.text(file);
    let stored = hyd_syntax::parse(file, text).value;
    // Other files may read what a package holds.
    if stored.within.is_some() {
        return None;
    }
    let mut declared = Vec::new();
    for class in &stored.classes {
        parameters(class, &mut declared);
    }
    let occurs = |name: &str| tokens(text).filter(|token| token.kind == Kind::Word && token.text == name).count();
    let unused: Vec<String> = declared.into_iter().filter(|name| occurs(name) == 1).collect();
    let sentence = match &unused[..] {
        [only] => format!("`{only}` is declared and used nowhere: what needs it may be missing"),
        [] => return None,
        several => format!("`{}` are declared and used nowhere: what needs them may be missing", several.join("`, `")),
    };
    (unused.len() <= MOST).then_some(sentence)
}

/// Says in messages on missing equations which parameters of the text nothing uses.
pub(crate) fn tell_unused(diagnostics: &mut [Diagnostic], files: &Files, name: &str) {
    let is_of_equations = |own: &&mut Diagnostic| match own.severity {
        Severity::Error => matches!(own.code, Code::Unbalanced | Code::Singular),
        _ => own.message.starts_with(OPEN_START),
    };
    let mut told = diagnostics.iter_mut().filter(is_of_equations);
    if let Some(first) = told.next()
        && let Some(sentence) = unused_parameters(files, name)
    {
        first.notes.push(sentence);
    }
}

/// Names of the parameters of models, with those of classes in them.
fn parameters(class: &ClassDef, names: &mut Vec<String>) {
    for nested in hyd_instance::class::nested_classes(class) {
        parameters(&nested.class, names);
    }
    let ClassBody::Long { elements, .. } = &class.body else { return };
    if !matches!(class.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class) {
        return;
    }
    for element in elements {
        if let Element::Component(component) = element
            && component.variability == Variability::Parameter
        {
            names.push(component.name.name.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use hyd_source::Files;

    use super::unused_parameters;

    #[test]
    fn what_stands_in_its_declaration_alone_is_named() {
        let said = |text: &str| {
            let mut files = Files::new();
            files.add("m.mo", text);
            unused_parameters(&files, "m.mo")
        };
        let text = "model M \"kb\"\n  parameter Real ki = 1;\n  parameter Real kb = 2; // kb\n  Real x = ki;\nend M;\n";
        assert_eq!(said(text).as_deref(), Some("`kb` is declared and used nowhere: what needs it may be missing"));
        assert_eq!(said(&text.replace("= ki", "= ki*kb")), None);
        assert_eq!(said(&format!("within P;\n{text}")), None);
        assert_eq!(said(&text.replace("model", "record")), None);
    }
}
