//! A run that failed, as a message with the line at fault marked.
//!
//! The solver knows names, file and line; the texts are still at hand here, so its sentences become a diagnostic like
//! those of the translation.

use hyd_compiler::{Code, Diagnostic, Files, FlatModel};
use hyd_runtime::SolveError;
use hyd_source::Span;
use hyd_system::significant;

/// Values of steps are shown that differ by more than this part from the one before.
const TOLD_APART: f64 = 0.05;

/// Parameters whose unit may be another one; of more the first are named.
const MOST_SUSPECTS: usize = 3;

/// The diagnostic of a failed run: its first sentence, the equation marked, everything else below.
pub fn diagnostic(error: &SolveError, files: &Files, flat: Option<&FlatModel>, kept: Option<String>) -> Diagnostic {
    let text = error.to_string();
    let mut lines = text.lines();
    let mut diagnostic = Diagnostic::error(Code::Run, lines.next().unwrap_or("the run failed"));
    let spans: Vec<Span> = error.places().iter().filter_map(|(file, line)| span_of(files, file, *line)).collect();
    for span in &spans {
        diagnostic = diagnostic.at(*span, "");
    }
    if spans.is_empty() {
        let block = error.variable().and_then(|name| flat.and_then(|flat| declaration(flat, name)));
        if let Some((span, name)) = block {
            diagnostic = diagnostic.at(span, format!("`{name}` is declared here"));
        }
    }
    // Where a function has left a value unset, what it compares approaches zero, but that is not at fault.
    let is_unset = matches!(error, SolveError::NotFinite(report) if report.place.evaluation.as_ref().is_some_and(|own| own.is_unset()));
    let approached = error.course().zip(flat).filter(|_| !is_unset).map_or_else(Vec::new, |(course, flat)| {
        let times: Vec<f64> = course.times().collect();
        hyd_compiler::approaches(flat, error.variable(), &times, &|row, name| course.value(row, name))
    });
    let time = significant(error.time().unwrap_or_default());
    match (approached.first(), error) {
        (Some(first), SolveError::StepTooSmall(_)) => {
            diagnostic.message = format!("the step size collapsed at t = {time} s: {} approaches zero", first.what);
        }
        (Some(first), SolveError::NoConvergence(_)) => {
            diagnostic.message =
                format!("the equations could not be solved beyond t = {time} s: {} approaches zero", first.what);
        }
        (Some(first), SolveError::TooManySteps { .. }) => {
            diagnostic.message.push_str(&format!("; {} approaches zero", first.what));
        }
        // That a derivative is not finite says less than what is not.
        (Some(first), SolveError::NotFinite(report))
            if report.place.evaluation.as_ref().is_some_and(|own| own.reason.contains("in its derivative")) =>
        {
            let said = std::mem::replace(
                &mut diagnostic.message,
                format!("no finite value beyond t = {time} s: {} approaches zero", first.what),
            );
            diagnostic = diagnostic.help(said);
        }
        (None, SolveError::NoConvergence(_)) => {
            if let Some(vanishing) = error.near().and_then(|near| near.vanishing.as_ref()) {
                let equation = vanishing.equation.as_ref().map_or("an equation", |own| &own.text);
                diagnostic.message = format!(
                    "the equations could not be solved beyond t = {time} s: `{equation}` no longer determines `{}`",
                    vanishing.variable
                );
            }
        }
        _ => {}
    }
    let is_approached = !approached.is_empty();
    for approach in approached {
        let (before, now) = (significant(approach.before), significant(approach.now));
        diagnostic = diagnostic.with(approach.span, "");
        let mut text = format!("{} approaches zero: {before} at the start", approach.what);
        // Steps that are too close to tell apart say nothing.
        let mut last = approach.before;
        let told = approach.recent.iter().filter(|value| {
            let differs = (**value - last).abs() > TOLD_APART * last.abs();
            last = **value;
            differs
        });
        let recent: Vec<String> = told.map(|value| significant(*value)).collect();
        if !recent.is_empty() {
            text.push_str(&format!(", {} over the last steps", recent.join(", ")));
        }
        text.push_str(&format!(", {now} at the end"));
        diagnostic = diagnostic.help(text).maybe_help(approach.beyond);
    }
    for line in lines.map(str::trim) {
        // Where the line is shown, saying it again helps nobody.
        let shown = !spans.is_empty() && (line.starts_with("equation: ") || line.starts_with("at "));
        if let (true, Some((_, component))) = (shown && line.starts_with("at "), line.split_once(" in ")) {
            diagnostic = diagnostic.help(format!("in the component {component}"));
        }
        // What is approached is said above; that something jumps would be another cause.
        if !(shown || is_approached && line == hyd_runtime::JUMPS) {
            diagnostic = diagnostic.help(line.trim_start_matches("hint: "));
        }
    }
    if is_of_values(error) {
        for suspect in flat.map(hyd_compiler::suspects).unwrap_or_default().into_iter().take(MOST_SUSPECTS) {
            diagnostic = diagnostic.with(suspect.span, "is this the unit that is meant?").help(suspect.words);
        }
    }
    diagnostic.maybe_help(kept)
}

/// True for failures that a wrong number may have caused.
fn is_of_values(error: &SolveError) -> bool {
    !matches!(error, SolveError::Option(_) | SolveError::Interrupted { .. } | SolveError::Sink { .. })
}

/// Where the variable of this name (or its start value or derivative) is declared.
pub(crate) fn declaration<'a>(flat: &FlatModel, name: &'a str) -> Option<(Span, &'a str)> {
    let name = name.trim_start_matches("der(").trim_end_matches(')').trim_end_matches(".start");
    let block = flat.variables.iter().find(|block| {
        let starts = block.name.parts.first().is_some_and(|(text, _)| name.starts_with(text.as_ref()));
        starts && (0..block.count as usize).any(|k| block.name.element(k) == name)
    })?;
    Some((block.origin.span, name))
}

/// The text of a line without the space around it.
fn span_of(files: &Files, name: &str, line: u32) -> Option<Span> {
    let file = files.ids().find(|&file| files.name(file).as_ref() == name)?;
    let text = files.text(file);
    let mut start = 0;
    for (k, content) in text.split_inclusive('\n').enumerate() {
        if k as u32 + 1 == line {
            let indent = content.len() - content.trim_start().len();
            let end = start + content.trim_end().len();
            return (start + indent < end).then(|| Span::new(file, start + indent, end));
        }
        start += content.len();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_marked_without_its_indent() {
        let mut files = Files::new();
        let file = files.add("a.hyd", "model A\n  x = 1;\n\nend A;\n");
        assert_eq!(span_of(&files, "a.hyd", 2), Some(Span::new(file, 10, 16)));
        assert_eq!(span_of(&files, "a.hyd", 3), None);
        assert_eq!(span_of(&files, "a.hyd", 9), None);
        assert_eq!(span_of(&files, "b.hyd", 1), None);
    }
}
