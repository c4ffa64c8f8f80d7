//! `hyd compare A B`: how far two results lie apart.
//!
//! The deviation of a variable is a part of the range of its values; one beyond the tolerance ends the command with code 1, and so
//! does what only one of the results has, be it a variable or a part of the time, unless `--common` asks for the rest alone.

use std::path::Path;

use hyd_results::{Deviation, Table, deviations};
use serde_json::json;

use crate::arguments::Compare;
use crate::{Failure, output};
use hyd_run::Selection;
use hyd_verbs::result_table;

/// Variables that are listed when nobody asks for all.
const FEW: usize = 20;
/// Window of time, as a part of the common time, when nobody says which.
const WINDOW: f64 = 1e-4;

/// Runs the verb.
pub(crate) fn compare(arguments: &Compare) -> Result<(), Failure> {
    if !(arguments.tolerance >= 0.0 && arguments.tolerance.is_finite()) {
        return Err(Failure::Usage("--tolerance: expected a number that is not negative".to_string()));
    }
    if arguments.time_tolerance.is_some_and(|w| !(w >= 0.0 && w.is_finite())) {
        return Err(Failure::Usage("--time-tolerance: expected a time in s that is not negative".to_string()));
    }
    let selection = Selection::new(arguments.variables.as_deref())?;
    let (a, b) = (result_table::read(&arguments.first)?, result_table::read(&arguments.second)?);
    let ((from, to), apart) = common_time(&a, &b, arguments)?;
    let window = arguments.time_tolerance.unwrap_or(WINDOW * (to - from));
    // Ends that lie no farther apart than jumps may.
    let uncovered = apart.filter(|apart| *apart > window);
    let mut found = deviations(&a, &b, window);
    found.retain(|deviation| selection.matches(&deviation.name));
    if found.is_empty() {
        return Err(Failure::Fault("the two results have no variable in common that is to be compared".to_string()));
    }
    // Largest first; equal ones keep the order of the file.
    found.sort_by(|x, y| y.relative().total_cmp(&x.relative()));
    let beyond = found.iter().filter(|deviation| deviation.relative() > arguments.tolerance).count();
    let missing = missing(&a, &b, &selection);
    let is_whole = arguments.common || (missing.0.is_empty() && missing.1.is_empty() && uncovered.is_none());
    let outcome =
        Outcome { a: &a, b: &b, found, missing, common: (from, to), uncovered, beyond, equal: beyond == 0 && is_whole };
    output::print(&if arguments.json { outcome.json(arguments) } else { outcome.text(arguments) })?;
    if outcome.equal { Ok(()) } else { Err(Failure::Reported) }
}

/// What came out.
struct Outcome<'a> {
    a: &'a Table,
    b: &'a Table,
    /// Largest first.
    found: Vec<Deviation>,
    /// Names that only the first, only the second result has.
    missing: (Vec<String>, Vec<String>),
    /// The time that both cover (s).
    common: (f64, f64),
    /// How long a part of the time only one covers (s), where that counts.
    uncovered: Option<f64>,
    /// Variables beyond the tolerance.
    beyond: usize,
    equal: bool,
}

/// The time that both cover, and how far their ends lie apart, the larger of the two.
fn common_time(a: &Table, b: &Table, arguments: &Compare) -> Result<((f64, f64), Option<f64>), Failure> {
    let span = |table: &Table, path: &Path| match (table.times.first(), table.times.last()) {
        (Some(&first), Some(&last)) => Ok((first, last)),
        _ => Err(Failure::Fault(format!("`{}` has no rows", path.display()))),
    };
    let (of_a, of_b) = (span(a, &arguments.first)?, span(b, &arguments.second)?);
    let (from, to) = (of_a.0.max(of_b.0), of_a.1.min(of_b.1));
    if from > to {
        return Err(Failure::Fault("the two results have no time in common".to_string()));
    }
    let apart = (of_a.0 - of_b.0).abs().max((of_a.1 - of_b.1).abs());
    Ok(((from, to), (apart > 0.0).then_some(apart)))
}

/// Variables that only one of the results has.
fn missing(a: &Table, b: &Table, selection: &Selection) -> (Vec<String>, Vec<String>) {
    let only = |x: &Table, y: &Table| {
        let constants = y.constants.iter().map(|(name, _)| name);
        let known: std::collections::BTreeSet<&String> = y.names.iter().chain(constants).collect();
        x.names.iter().filter(|name| !known.contains(name) && selection.matches(name)).cloned().collect()
    };
    (only(a, b), only(b, a))
}

impl Outcome<'_> {
    fn text(&self, arguments: &Compare) -> String {
        let found = &self.found;
        let few = if arguments.all { found.len() } else { FEW.min(found.len()) };
        let width = found[..few].iter().map(|d| d.name.chars().count()).max().unwrap_or(0).max("variable".len());
        let mut text = format!("{:<width$}  {:>12}  {:>12}  {:>12}\n", "variable", "deviation", "of range", "at s");
        for deviation in &found[..few] {
            let mark = if deviation.relative() > arguments.tolerance { "  beyond" } else { "" };
            text.push_str(&format!(
                "{:<width$}  {:>12.4e}  {:>12.4e}  {:>12.6}{mark}\n",
                deviation.name,
                deviation.largest,
                deviation.relative(),
                deviation.time,
            ));
        }
        if few < found.len() {
            text.push_str(&format!("... and {} with smaller deviations (--all lists them)\n", found.len() - few));
        }
        for (names, path) in [(&self.missing.0, &arguments.first), (&self.missing.1, &arguments.second)] {
            if !names.is_empty() {
                let shown = names.iter().take(5).map(String::as_str).collect::<Vec<_>>().join(", ");
                let more = if names.len() > 5 { ", ..." } else { "" };
                text.push_str(&format!("only in {}: {} ({shown}{more})\n", path.display(), names.len()));
            }
        }
        if self.uncovered.is_some() {
            for (table, path) in [(self.a, &arguments.first), (self.b, &arguments.second)] {
                let span = (table.times.first(), table.times.last());
                if let (Some(from), Some(to)) = span {
                    text.push_str(&format!("{} covers {from} to {to} s\n", path.display()));
                }
            }
        }
        let (from, to) = self.common;
        text.push_str(&format!(
            "{} compared from {from} to {to} s, {} beyond {} of their range\n",
            if found.len() == 1 { "1 variable".to_string() } else { format!("{} variables", found.len()) },
            self.beyond,
            arguments.tolerance,
        ));
        if !self.equal && self.beyond == 0 {
            text.push_str("one has what the other lacks (--common compares the rest alone)\n");
        }
        text
    }

    fn json(&self, arguments: &Compare) -> String {
        // An infinite deviation (not a number on one side only) has no JSON number and becomes null.
        let variables: Vec<_> = self
            .found
            .iter()
            .map(|d| {
                json!({"name": d.name, "deviation": d.largest, "relative": d.relative(), "time": d.time, "scale": d.scale})
            })
            .collect();
        let object = json!({
            "status": if self.equal { "equal" } else { "different" },
            "tolerance": arguments.tolerance,
            "from": self.common.0,
            "to": self.common.1,
            "uncovered": self.uncovered,
            "beyond": self.beyond,
            "variables": variables,
            "only_first": self.missing.0,
            "only_second": self.missing.1,
        });
        format!("{object}\n")
    }
}
