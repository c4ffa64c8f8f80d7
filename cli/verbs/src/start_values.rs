//! Start values that lead nowhere, as a message with the change that heals it.
//!
//! Where Newton's method finds no initial values from the start values of a model, the solver looks for them elsewhere and knows the fewest
//! start values that would have led there.  Here its sentence becomes a diagnostic with the edits of the declarations.

use hyd_compiler::{Code, Compilation, Diagnostic, Edit, Files, FlatModel};
use hyd_results::Discard;
use hyd_runtime::{Options, Rescue, Simulator};
use hyd_source::Span;
use hyd_system::{DaeSystem, significant};

use crate::run_failure::declaration;

/// Looks for the initial values of a model that was translated for runs; a warning where its start values do not lead to them.
/// That there are none at all is a matter of the run.
pub fn start_warning(compilation: &Compilation) -> Option<Diagnostic> {
    let model = compilation.model.as_ref()?;
    let mut system = model.on(hyd_payload::Backend::Native).ok()?.instantiate();
    let start = model.payload().experiment.start.unwrap_or(0.0);
    // No step is asked for: the first question whether to stop is answered by yes.
    let options = Options { rescue: true, ..Options::new(start, start + 1.0) };
    let mut simulator = Simulator::new(system.structure());
    let _ = simulator.run(&mut system, &options, &mut Discard, &|| true);
    let rescue = simulator.rescue()?;
    Some(rescue_diagnostic(rescue, &compilation.files, compilation.flat.as_deref()))
}

/// What the solver says of initial values that it found elsewhere, with the change of the start values that stand in the model's own text.
pub fn rescue_diagnostic(rescue: &Rescue, files: &Files, flat: Option<&FlatModel>) -> Diagnostic {
    let mut diagnostic = Diagnostic::warning(Code::Run, rescue.to_string());
    let mut edits = Vec::new();
    for start in &rescue.starts {
        let declared =
            flat.and_then(|flat| declaration(flat, &start.name)).filter(|_| !start.name.contains(['.', '[']));
        let edit = declared.and_then(|(span, _)| set_start(files, span, start.works));
        let Some((span, edit)) = declared.map(|own| own.0).zip(edit) else { return diagnostic };
        diagnostic = diagnostic.at(span, "");
        edits.push(edit);
    }
    let names: Vec<String> = rescue.starts.iter().map(|own| format!("`{}`", own.name)).collect();
    match edits.is_empty() {
        true => diagnostic,
        false => diagnostic.propose(format!("set the start value of {}", names.join(", ")), edits),
    }
}

/// The change that gives the scalar declared at `name` another start value.
fn set_start(files: &Files, name: Span, value: f64) -> Option<Edit> {
    let text = files.text(name.file);
    let end = name.end as usize;
    let rest = text.get(end..)?;
    let put = |from: usize, to: usize, text: String| Some(Edit { span: Span::new(name.file, from, to), text });
    let value = significant(value);
    let blank = rest.len() - rest.trim_start().len();
    if !rest.trim_start().starts_with('(') {
        return put(end, end, format!("(start = {value})"));
    }
    let open = end + blank + 1;
    let (mut depth, mut from) = (0_i32, open);
    for (k, c) in text[open..].char_indices() {
        let at = open + k;
        match c {
            '(' | '{' | '[' => depth += 1,
            ',' | ')' if depth == 0 => {
                let argument = &text[from..at];
                if let Some(given) = argument
                    .trim_start()
                    .strip_prefix("start")
                    .map(str::trim_start)
                    .and_then(|own| own.strip_prefix('='))
                {
                    let given = given.trim_start();
                    return put(at - given.len(), at - (given.len() - given.trim_end().len()), value);
                }
                if c == ')' {
                    return put(open, open, format!("start = {value}, "));
                }
                from = at + 1;
            }
            ')' | '}' | ']' => depth -= 1,
            '"' | ';' => return None,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_values_are_replaced_or_put_in() {
        for (text, expected) in [
            ("Real x;", "Real x(start = -2);"),
            ("Real x(start = 3);", "Real x(start = -2);"),
            ("Real x(min = -5, start = f(1, {2, 3}) );", "Real x(min = -5, start = -2 );"),
            ("Real x(min = -5) = 1;", "Real x(start = -2, min = -5) = 1;"),
        ] {
            let mut files = Files::new();
            let file = files.add("a.mo", text);
            let Edit { span, text: new } =
                set_start(&files, Span::new(file, 5, 6), -2.0).expect("a number to be replaced");
            let mut changed = text.to_string();
            changed.replace_range(span.start as usize..span.end as usize, &new);
            assert_eq!(changed, expected);
        }
    }
}
