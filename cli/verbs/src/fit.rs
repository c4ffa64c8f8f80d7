//! What may be off, fitted to the shots of a bench, and what is left.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;

use hyd_discovery::{
    Attempt, Fit as FitOf, FittedReport, Gap, Meaning, Problem, Profile, Record, Setup, Unknown, Weighing,
};
use hyd_results::{refuse_read, write_whole};
use hyd_system::as_known;
use serde_json::{Value, json};

use crate::study::{Opened, failure, tell_whole_loops};
use crate::{Failure, Listener, fit_report};

/// Misfits from here on are written with an exponent.
const MOST_PLAIN: f64 = 1e9;

/// Standard errors to either side that hold 95 % of a normal distribution.
const ERRORS: f64 = 1.96;
/// Unit of what holds under the conditions of one shot only.
const OF_CONDITION: &str = "% of its condition";

/// The message on values that are not a minimum.
const UNCONVERGED: &str = "the fit has not converged: the values are where it was given up, and their errors mean little; try another --seed \
                           or narrower tolerances";

/// How a fit is done, and what is asked of it.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// Seed of random starts.
    pub seed: u64,
    /// Names of what may be off whose 95 % interval is wanted.
    pub profile: Vec<String>,
    /// Where the parameters as fitted are written.
    pub write_parameters: Option<PathBuf>,
    /// Folder of a report: a page, a picture, curves, values.
    pub report: Option<PathBuf>,
}

/// A fit, told.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// For people.
    pub text: String,
    /// For programs.
    pub json: Value,
    /// The parameters as fitted, with the conditions of the first fitted shot, as a file of parameters.
    pub parameters: String,
    /// Why the values are not a minimum, if they are not.
    pub unconverged: Option<String>,
}

/// What came out.
struct Outcome<'a> {
    setup: &'a Setup,
    problem: &'a Problem<'a>,
    found: FitOf,
    record: Record,
    /// Misfit over that of noise.
    ratio: f64,
    train: Gap,
    held_out: Option<Gap>,
    profiles: Vec<(&'a str, Profile)>,
    seconds: f64,
    /// Runs that were done again with whole loops.
    whole_loops: usize,
}

/// Fits what may be off to the shots.
///
/// # Errors
/// A model that cannot be translated or run, a name that is not fitted, a file that cannot be written.
pub fn fit(opened: &Opened, options: &FitOptions, listener: &dyn Listener) -> Result<Fitted, Failure> {
    let setup = &opened.setup;
    let make = || opened.sources();
    let machine = opened.machine(&opened.workshop(&make), listener)?;
    let problem = setup.problem(&machine, &[]).map_err(failure)?;
    let wanted = wanted(&options.profile, setup, &problem)?;
    if let Some(folder) = &options.report {
        fit_report::check(folder)?;
    }
    let begin = Instant::now();
    let progress = |text: &str| listener.progress(begin.elapsed().as_secs_f64(), text);
    let tau = setup.study.shots.time_tolerance;
    let whole = Weighing::whole(&setup.train, tau);
    let (found, record) = FitOf::of(&problem, &setup.train, (tau, options.seed), &progress).map_err(failure)?;
    let (found, all) = Profile::of(&problem, found, &whole, &wanted, &progress).map_err(failure)?;
    let names = wanted.iter().map(|&k| problem.unknowns[k].name.as_str());
    let profiles = names.zip(all).collect();
    let train = Gap::of(&problem, &found.xi, &setup.train, false).map_err(failure)?;
    let held_out = match setup.held_out.is_empty() {
        true => None,
        false => {
            progress("the shots held out");
            Some(Gap::of(&problem, &found.xi, &setup.held_out, true).map_err(failure)?)
        }
    };
    let parameters = problem.parameter_file(&found.xi, setup.train[0], &setup.bench.name);
    if let Some(path) = &options.write_parameters {
        let done = refuse_read(path).and_then(|()| write_whole(path, parameters.as_bytes()));
        done.map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display())))?;
    }
    let (ratio, seconds) = (found.misfit / problem.expected(&whole), begin.elapsed().as_secs_f64());
    let whole_loops = tell_whole_loops(setup, listener);
    let outcome =
        Outcome { setup, problem: &problem, found, record, ratio, train, held_out, profiles, seconds, whole_loops };
    let (mut text, json) = (outcome.text(), outcome.json());
    if let Some(folder) = &options.report {
        progress("writing the report");
        let report = FittedReport::of(&problem, setup, (&outcome.train, outcome.held_out.as_ref()));
        text += &fit_report::write(folder, setup, &report, (&json, &parameters))?;
    }
    let unconverged = match (&outcome.found.wall, outcome.found.converged) {
        (Some(wall), _) => Some(format!(
            "the fit has not converged: beyond its values, whose errors mean little, the model does not run: {wall}"
        )),
        (None, false) => Some(UNCONVERGED.to_string()),
        (None, true) => None,
    };
    Ok(Fitted { text, json, parameters, unconverged })
}

impl Outcome<'_> {
    /// Standard error of an unknown in standard deviations of its prior.
    fn error(&self, unknown: usize) -> f64 {
        self.found.standard_error(unknown).unwrap_or(f64::NAN)
    }

    /// True for the attempt that has led to where the model does not run further.
    fn is_stopped(&self, attempt: &Attempt) -> bool {
        self.found.wall.is_some() && attempt.cost == self.found.cost
    }

    fn json(&self) -> Value {
        let channels = |gap: &Gap| -> Value {
            let names = self.setup.data.channels.iter().map(|channel| channel.name.clone());
            names.zip(gap.channels.iter().map(|&value| json!(value))).collect::<serde_json::Map<_, _>>().into()
        };
        let found = &self.found;
        let unknowns = self.problem.unknowns.iter().enumerate().map(|(k, unknown)| {
            json!({"name": unknown.name, "value": unknown.value(found.xi[k]), "sd": found.xi[k], "sd_error": self.error(k),
                "fitted": is_fitted(self.setup, unknown), "at_limit": unknown.is_at_limit(found.xi[k]),
                "interval": self.interval(k), "in_units": self.in_units(k).map(|own| own.json())})
        });
        let attempts = self
            .record
            .attempts
            .iter()
            .map(|a| json!({"start": a.start, "misfit": a.misfit, "steps": a.steps, "converged": a.converged && !self.is_stopped(a)}));
        let profiles = self.profiles.iter().map(|(name, own)| {
            json!({"name": name, "low": own.interval.0, "high": own.interval.1, "points": own.points, "lower_found": own.lower_found})
        });
        json!({
            "set": self.setup.bench.name, "misfit": self.ratio, "cost": found.cost, "converged": found.converged && found.wall.is_none(),
            "does_not_run": found.wall,
            "gap": {"train": {"all": self.train.all, "channels": channels(&self.train)},
                "heldout": self.held_out.as_ref().map(|gap| json!({"all": gap.all, "channels": channels(gap)}))},
            "unknowns": unknowns.collect::<Vec<_>>(), "attempts": attempts.collect::<Vec<_>>(),
            "profiles": profiles.collect::<Vec<_>>(), "simulations": self.setup.watch.runs(), "whole_loops": self.whole_loops,
            "seconds": self.seconds,
        })
    }

    /// Ends of the 95 % interval of an unknown: of its profile where there is one, else by its standard error.
    fn interval(&self, k: usize) -> [Option<f64>; 2] {
        let unknown = &self.problem.unknowns[k];
        if let Some((_, own)) = self.profiles.iter().find(|(name, _)| *name == unknown.name) {
            return [own.interval.0, own.interval.1];
        }
        let end = |sign: f64| unknown.value(self.found.xi[k] + sign * ERRORS * self.error(k));
        [end(-1.0), end(1.0)].map(|end| Some(end).filter(|end| end.is_finite()))
    }

    /// The parameter that an unknown stands for, in its unit; none for what is no parameter or several of them.
    fn in_units(&self, k: usize) -> Option<InUnits> {
        let unknown = &self.problem.unknowns[k];
        let (xi, error) = (self.found.xi[k], self.error(k));
        let [place] = unknown.places() else { return None };
        let shot = unknown.shot.unwrap_or(self.setup.train[0]);
        let (place, base) = (&self.problem.places[*place], self.problem.base[shot][*place]);
        let of_condition = self.is_condition(place.name());
        let unit = self.problem.machine.unit(place);
        // What a value of the unknown is in units of the parameter.
        let scale = |value: f64| match unknown.meaning {
            Meaning::Relative { .. } if of_condition => 100.0 * (value - 1.0),
            Meaning::Relative { .. } => base * value,
            _ => value,
        };
        let spread = match unknown.meaning {
            // Under the conditions of one shot only, where these decide the parameter.
            Meaning::Relative { sigma, .. } if of_condition => 100.0 * sigma,
            Meaning::Relative { sigma, .. } => (base * sigma).abs(),
            Meaning::Value { .. } => unknown.slope(0.0).abs(),
            _ => return None,
        };
        let error = error * if let Meaning::Value { .. } = unknown.meaning { unknown.slope(xi).abs() } else { spread };
        let mut interval = self.interval(k).map(|end| end.map(scale));
        if scale(2.0) < scale(1.0) {
            interval.reverse();
        }
        Some(InUnits {
            parameter: place.name().to_string(),
            unit: if of_condition { OF_CONDITION.to_string() } else { unit.to_string() },
            value: scale(unknown.value(xi)),
            error,
            interval,
            expected: scale(unknown.value(0.0)),
            spread,
        })
    }

    fn is_condition(&self, name: &str) -> bool {
        self.setup.study.conditions.contains_key(name)
    }

    fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}: misfit {:.3} times that of noise alone", self.setup.bench.name, self.ratio);
        for attempt in &self.record.attempts {
            let ended = match attempt.converged {
                _ if self.is_stopped(attempt) => "stopped where the model does not run further",
                true => "converged",
                false => "not converged",
            };
            let misfit = attempt.misfit;
            // A way that ends in nonsense needs no hundred digits.
            let misfit = if misfit < MOST_PLAIN { format!("{misfit:.3}") } else { format!("{misfit:.3e}") };
            let _ = writeln!(text, "  {}: {misfit}, {} steps, {ended}", attempt.start, attempt.steps);
        }
        // Without shots held out there is no column for them.
        let heading = if self.held_out.is_some() { "  held out" } else { "" };
        let _ = writeln!(text, "\ngap (1.00 is noise)        fitted{heading}");
        for (k, channel) in self.setup.data.channels.iter().enumerate() {
            let unseen = self.held_out.as_ref().map_or(String::new(), |gap| format!("  {}", cell(gap.channels[k])));
            let _ = writeln!(text, "  {:22} {}{unseen}", channel.name, cell(self.train.channels[k]));
        }
        let _ = writeln!(text, "\nwhat may be off               value  in standard deviations");
        for (k, unknown) in
            self.problem.unknowns.iter().enumerate().filter(|(_, unknown)| is_fitted(self.setup, unknown))
        {
            let factor = matches!(unknown.meaning, Meaning::Relative { .. } | Meaning::Gain { .. });
            let (sign, xi) = (if factor { "x" } else { " " }, self.found.xi[k]);
            let (value, error) = (unknown.value(xi), self.error(k));
            let _ = writeln!(
                text,
                "  {:22} {sign}{value:11.5e}  {xi:+6.2} +- {error:.2}{}{}",
                unknown.name,
                self.in_units(k).map_or_else(String::new, |own| own.text()),
                if unknown.is_at_limit(xi) { "  (at the limit)" } else { "" }
            );
        }
        let unknowns = self.problem.unknowns.iter().zip(&self.found.xi);
        let mut held = unknowns.filter(|&(unknown, &xi)| is_fitted(self.setup, unknown) && unknown.is_at_limit(xi));
        if held.next().is_some() {
            let _ = writeln!(
                text,
                "  (at the limit): the measurement would have it farther than {} standard deviations, where it is held; is its \
                 tolerance right?",
                Unknown::LIMIT
            );
        }
        if !self.profiles.is_empty() {
            let _ = writeln!(text, "\n95 % intervals from profiles");
        }
        for (name, own) in &self.profiles {
            let end = |end: Option<f64>| end.map_or("open".to_string(), |value| format!("{value:.5e}"));
            let _ = writeln!(text, "  {name:22}  {} to {}", end(own.interval.0), end(own.interval.1));
            if own.lower_found {
                let _ =
                    writeln!(text, "    the fit was not a minimum: the cost decreases on the way; try another --seed");
            }
        }
        let _ = writeln!(text, "\n{} runs of one shot, {:.1} s", self.setup.watch.runs(), self.seconds);
        text
    }
}

/// A parameter as fitted, in its unit.
struct InUnits {
    parameter: String,
    unit: String,
    value: f64,
    /// Standard error.
    error: f64,
    /// Ends of the 95 % interval.
    interval: [Option<f64>; 2],
    expected: f64,
    /// Standard deviation of what was expected.
    spread: f64,
}

impl InUnits {
    /// `  ro.rlc.R = 0.905 +- 0.011 Ohm (expected 0.9 +- 0.018)`.
    fn text(&self) -> String {
        let InUnits { parameter, unit, value, error, expected, spread, .. } = self;
        if unit == OF_CONDITION {
            return format!("  {parameter} {value:+.2} +- {error:.2} {unit}");
        }
        let unit = if unit.is_empty() || unit == "1" { String::new() } else { format!(" {unit}") };
        let of = |value, error| format!("{} +- {}", as_known(value, error), as_known(error, error));
        format!("  {parameter} = {}{unit} (expected {})", of(*value, *error), of(*expected, *spread))
    }

    fn json(&self) -> Value {
        json!({"parameter": self.parameter, "unit": self.unit, "value": self.value, "stderr": self.error, "interval": self.interval,
            "expected": self.expected, "expected_sd": self.spread})
    }
}

/// A gap in its column; a channel none of whose samples counts has none.
fn cell(gap: f64) -> String {
    if gap.is_finite() { format!("{gap:8.2}") } else { format!("{:>8}", "-") }
}

/// What belongs to a shot that was held out stays where its prior has it.
fn is_fitted(setup: &Setup, unknown: &Unknown) -> bool {
    unknown.shot.is_none_or(|shot| !setup.held_out.contains(&shot))
}

/// Numbers of the unknowns whose profiles are asked for.
fn wanted(names: &[String], setup: &Setup, problem: &Problem<'_>) -> Result<Vec<usize>, Failure> {
    let find = |name: &String| match problem.unknowns.iter().position(|unknown| unknown.name == *name) {
        Some(k) if is_fitted(setup, &problem.unknowns[k]) => Ok(k),
        Some(_) => Err(Failure::Usage(format!("`{name}` is not fitted: its shot is held out"))),
        None => {
            let fitted = problem.unknowns.iter().filter(|unknown| is_fitted(setup, unknown));
            let known: Vec<&str> = fitted.map(|unknown| unknown.name.as_str()).collect();
            Err(Failure::Usage(format!("`{name}` is not among what may be off: {}", known.join(", "))))
        }
    };
    names.iter().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::as_known;

    #[test]
    fn values_are_shown_as_far_as_they_are_known() {
        for (value, error, shown) in [
            (3005.4321, 9.1, "3005.4"),
            (0.9012345, 0.0113, "0.901"),
            (-2.0e9, 3.0e7, "-2.000e9"),
            (1.2345e-6, 2.0e-8, "1.234e-6"),
            (123_456.0, 2000.0, "123456"),
            (0.0, 0.25, "0.00"),
        ] {
            assert_eq!(as_known(value, error), shown);
        }
    }
}
