//! `hyd fit STUDY.toml --bench SET.json`: what may be off, fitted to the shots, and what is left.

use std::fmt::Write;
use std::time::Instant;

use hyd_discovery::fit::schedule;
use hyd_discovery::problem::Weighing;
use hyd_discovery::proof::{Gap, gap};
use hyd_discovery::unknowns::Meaning;
use serde_json::{Value, json};

use crate::arguments::Fit;
use crate::study::open;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn fit(arguments: &Fit) -> Result<(), Failure> {
    let opened = open(&arguments.study)?;
    let setup = &opened.setup;
    let make = || opened.sources();
    let model = opened.workshop(&make).translate(&[])?;
    let machine = setup.machine(&model)?;
    let problem = setup.problem(&machine, &[])?;
    let begin = Instant::now();
    let tau = setup.study.shots.time_tolerance;
    let start = vec![0.0; problem.unknowns.len()];
    let (mut found, mut record) = schedule::fit(&problem, &start, &setup.train, tau)?;
    let expected = problem.expected(&Weighing::whole(&setup.train, tau));
    if found.misfit / expected > schedule::GOOD {
        found = schedule::retry(&problem, found, &setup.train, (tau, arguments.study.seed), &mut record);
    }
    let train = gap(&problem, &found.xi, &setup.train, false)?;
    let held_out = match setup.held_out.is_empty() {
        true => None,
        false => Some(gap(&problem, &found.xi, &setup.held_out, true)?),
    };
    let ratio = found.misfit / expected;
    let error = |k: usize| found.standard_error(k).unwrap_or(f64::NAN);
    let channels = |gap: &Gap| -> Value {
        let names = setup.data.channels.iter().map(|channel| channel.name.clone());
        names.zip(gap.channels.iter().map(|&value| json!(value))).collect::<serde_json::Map<_, _>>().into()
    };
    if arguments.json {
        let unknowns = problem.unknowns.iter().enumerate().map(|(k, unknown)| {
            json!({"name": unknown.name, "value": unknown.value(found.xi[k]), "sd": found.xi[k], "sd_error": error(k)})
        });
        let object = json!({
            "set": setup.bench.name, "misfit": ratio, "cost": found.cost, "converged": found.converged,
            "gap": {"train": {"all": train.all, "channels": channels(&train)},
                "heldout": held_out.as_ref().map(|gap| json!({"all": gap.all, "channels": channels(gap)}))},
            "unknowns": unknowns.collect::<Vec<_>>(),
            "attempts": record.attempts.iter().map(|a| json!({"start": a.start, "misfit": a.misfit, "steps": a.steps, "converged": a.converged})).collect::<Vec<_>>(),
            "simulations": machine.runs(), "seconds": begin.elapsed().as_secs_f64(),
        });
        return output::print(&format!("{object}\n"));
    }
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{}: misfit {ratio:.3} of what noise makes", setup.bench.name);
    for attempt in &record.attempts {
        let ended = if attempt.converged { "converged" } else { "not converged" };
        let _ = writeln!(text, "  {}: {:.3}, {} steps, {ended}", attempt.start, attempt.misfit, attempt.steps);
    }
    let _ = writeln!(text, "\ngap (1.00 is noise)        fitted  held out");
    for (k, channel) in setup.data.channels.iter().enumerate() {
        let unseen = held_out.as_ref().map_or(f64::NAN, |gap| gap.channels[k]);
        let _ = writeln!(text, "  {:22} {:8.2}  {unseen:8.2}", channel.name, train.channels[k]);
    }
    let _ = writeln!(text, "\nwhat may be off               value  in standard deviations");
    for (k, unknown) in problem.unknowns.iter().enumerate() {
        let factor = matches!(unknown.meaning, Meaning::Relative { .. } | Meaning::Gain { .. });
        let sign = if factor { "x" } else { " " };
        let _ = writeln!(
            text,
            "  {:22} {sign}{:11.5e}  {:+6.2} +- {:.2}",
            unknown.name,
            unknown.value(found.xi[k]),
            found.xi[k],
            error(k)
        );
    }
    let _ = writeln!(text, "\n{} runs of one shot, {:.1} s", machine.runs(), begin.elapsed().as_secs_f64());
    output::print(&text)
}
