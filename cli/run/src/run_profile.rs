//! `--profile`: where the time of a run went and who kept its steps short, for people and as JSON.

use std::fmt::Write as _;

use hyd_runtime::{Profile, Statistics};
use hyd_system::Tables;

/// Lines of each list.
const MOST: usize = 8;

/// Counts of a variable, an equation, a relation or a component.
#[derive(serde::Serialize, Clone, PartialEq, Debug)]
pub struct Share {
    /// Its name or text.
    pub name: String,
    /// File and line, where it has a place of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
    /// How often.
    pub count: u64,
    /// Of a variable: the size at the end of the run that its absolute tolerance is made of, its nominal value or what was learned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// The unit of that size, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_unit: Option<String>,
}

impl Share {
    fn named(name: String, place: Option<String>) -> Self {
        Self { name, place, count: 0, size: None, size_unit: None }
    }
}

/// The profile of a run; times in s.
#[derive(serde::Serialize, Clone, PartialEq, Debug)]
pub struct RunProfile {
    /// The whole run.
    pub total_s: f64,
    /// Evaluations of residuals and of Jacobians.
    pub residuals_s: f64,
    /// See `residuals_s`.
    pub jacobians_s: f64,
    /// Finding initial values, stepping, and settling events, evaluations included.
    pub start_s: f64,
    /// See `start_s`.
    pub steps_s: f64,
    /// See `start_s`.
    pub events_s: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Accepted steps by the variable whose error was the largest.
    pub limited_by: Vec<Share>,
    /// The same by component.
    pub limited_by_component: Vec<Share>,
    /// Rejected attempts by the variable whose error was the largest.
    pub rejected_by: Vec<Share>,
    /// Attempts in which Newton's method did not converge, by the variable that moved most and by the equation that was off most.
    pub unconverged_by: Vec<Share>,
    /// See `unconverged_by`.
    pub unconverged_in: Vec<Share>,
    /// Events by relation.
    pub events_by: Vec<Share>,
    /// Rejected attempts, attempts that did not converge (by the component of the equation) and events (by the component of what is
    /// compared), by component; the model itself has no name.
    pub rejected_by_component: Vec<Share>,
    /// See `rejected_by_component`.
    pub unconverged_by_component: Vec<Share>,
    /// See `rejected_by_component`.
    pub events_by_component: Vec<Share>,
}

impl RunProfile {
    /// The profile in the user's names.
    pub fn new(profile: &Profile, tables: &Tables, statistics: &Statistics) -> Self {
        let unit = |k: usize| {
            let (variable, _) = tables.unknowns.get(k)?;
            tables.variables.get(*variable as usize).map(|own| own.unit.to_string()).filter(|unit| !unit.is_empty())
        };
        let unknown = |k: usize| Share {
            size: profile.sizes.get(k).copied(),
            size_unit: unit(k),
            ..Share::named(tables.unknown_name(k), None)
        };
        let unknowns = |counts: &[u64]| shares(counts, unknown);
        let equation = |k: usize| {
            let info = tables.row_equation(k);
            let name = info.map_or_else(|| format!("equation {}", k + 1), |info| info.text.to_string());
            Share::named(name, info.map(|info| format!("{}:{}", info.file, info.line)))
        };
        let relation = |k: usize| {
            let info = tables.roots.get(k);
            let name = info.map_or_else(|| format!("relation {}", k + 1), |info| info.text.to_string());
            Share::named(name, info.map(|info| format!("{}:{}", info.file, info.line)))
        };
        let component = |k: usize| {
            let name = tables.row_equation(k).map_or_else(String::new, |info| info.component.to_string());
            Share::named(name, None)
        };
        let limited_by = unknowns(&profile.limited);
        let rejected_by = unknowns(&profile.rejected);
        let events_by = shares(&profile.events, relation);
        let seconds = profile.seconds;
        Self {
            total_s: seconds.total,
            residuals_s: seconds.residuals,
            jacobians_s: seconds.jacobians,
            start_s: seconds.start,
            steps_s: seconds.steps,
            events_s: seconds.events,
            steps: statistics.steps,
            limited_by_component: by_component(&limited_by, component_of),
            rejected_by_component: by_component(&rejected_by, component_of),
            unconverged_by_component: by_component(&shares(&profile.unconverged_rows, component), |name| Some(name)),
            events_by_component: by_component(&events_by, compared_in),
            limited_by,
            rejected_by,
            unconverged_by: unknowns(&profile.unconverged),
            unconverged_in: shares(&profile.unconverged_rows, equation),
            events_by,
        }
    }

    /// Some lines for people.
    pub fn text(&self) -> String {
        let mut text = String::from("\nprofile, on the wall clock\n");
        let part = |seconds: f64| 100.0 * seconds / self.total_s.max(f64::MIN_POSITIVE);
        // Writing to a string cannot fail.
        let mut line = |what: &str, seconds: f64| {
            let _ = writeln!(text, "  {what:<34}{:>9.1} ms {:>5.1} %", 1e3 * seconds, part(seconds));
        };
        line("whole run", self.total_s);
        line("initial values", self.start_s);
        line("steps", self.steps_s);
        line("events", self.events_s);
        line("rest: output, looking for events", self.total_s - self.start_s - self.steps_s - self.events_s);
        line("of all this, residuals", self.residuals_s);
        line("of all this, Jacobians", self.jacobians_s);
        let lists = [
            ("steps limited by the error of", &self.limited_by, true),
            ("the same by component", &self.limited_by_component, true),
            ("steps rejected for the error of", &self.rejected_by, false),
            ("Newton's method did not converge, worst in", &self.unconverged_by, false),
            ("and in the equations", &self.unconverged_in, false),
            ("events by relation", &self.events_by, false),
        ];
        for (title, shares, of_steps) in lists {
            if shares.is_empty() {
                continue;
            }
            let _ = writeln!(text, "  {title}");
            for share in shares.iter().take(MOST) {
                let place = share.place.as_ref().map_or_else(String::new, |place| format!("  {place}"));
                let unit = share.size_unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
                let size = share.size.map_or_else(String::new, |size| format!("  (of size {size:.2e}{unit})"));
                let of = match of_steps {
                    true => format!(" {:>5.1} %", 100.0 * share.count as f64 / self.steps.max(1) as f64),
                    false => String::new(),
                };
                let _ = writeln!(text, "    {:>9}{of}  {}{place}{size}", share.count, share.name);
            }
            if let Some(more @ 1..) = shares.len().checked_sub(MOST) {
                let _ = writeln!(text, "    and {more} more, which `--json` lists");
            }
        }
        text
    }
}

/// Those that were counted, the most frequent first.
fn shares(counts: &[u64], of: impl Fn(usize) -> Share) -> Vec<Share> {
    let mut counted: Vec<(usize, u64)> = counts.iter().copied().enumerate().filter(|(_, count)| *count > 0).collect();
    counted.sort_by_key(|&(k, count)| (std::cmp::Reverse(count), k));
    counted.into_iter().map(|(k, count)| Share { count, ..of(k) }).collect()
}

/// Counts added up by the component that a name belongs to.
fn by_component(shares: &[Share], component: impl Fn(&str) -> Option<&str>) -> Vec<Share> {
    let mut all: Vec<Share> = Vec::new();
    for share in shares {
        let Some(component) = component(&share.name) else { continue };
        match all.iter_mut().find(|known| known.name == component) {
            Some(known) => known.count += share.count,
            None => all.push(Share { count: share.count, ..Share::named(component.to_string(), None) }),
        }
    }
    all.sort_by_key(|share| std::cmp::Reverse(share.count));
    all
}

/// The component of a variable or derivative; none for those of the model itself.
fn component_of(name: &str) -> Option<&str> {
    name.trim_start_matches("der(").rsplit_once('.').map(|(component, _)| component)
}

/// The component of the first variable in a relation that belongs to one, else the model itself.
fn compared_in(relation: &str) -> Option<&str> {
    let is_name = |c: char| c.is_alphanumeric() || "_.[]".contains(c);
    let mut names =
        relation.split(|c| !is_name(c)).filter(|name| name.starts_with(|c: char| c.is_alphabetic() || c == '_'));
    Some(names.find_map(component_of).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::{compared_in, component_of};

    #[test]
    fn components_are_read_from_names() {
        assert_eq!(component_of("der(valve.spool.x)"), Some("valve.spool"));
        assert_eq!(component_of("x"), None);
        assert_eq!(compared_in("time >= 0.5*drive.valve[2].T"), Some("drive.valve[2]"));
        assert_eq!(compared_in("x > 1.5"), Some(""));
    }
}
