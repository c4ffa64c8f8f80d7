//! `hyd fit STUDY.toml --bench SET.json`: what may be off, fitted to the shots, and what is left.

use std::fmt::Write;

use hyd_discovery::fit::schedule;
use hyd_discovery::problem::Weighing;
use hyd_discovery::variant::Workshop;

use crate::arguments::Fit;
use crate::study::open;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn fit(arguments: &Fit) -> Result<(), Failure> {
    let opened = open(&arguments.study)?;
    let setup = &opened.setup;
    let make = || opened.sources();
    let workshop = Workshop {
        sources: &make,
        preamble: opened.preamble(),
        class: opened.class.clone(),
        channels: setup.expressions(),
    };
    let model = workshop.translate(&[])?;
    let machine = setup.machine(&model)?;
    let problem = setup.problem(&machine, &[])?;
    let begin = std::time::Instant::now();
    let start = vec![0.0; problem.unknowns.len()];
    let (found, record) = schedule::fit(&problem, &start, &setup.train, setup.study.shots.time_tolerance)?;
    let whole = Weighing::whole(&setup.train, setup.study.shots.time_tolerance);
    let mut text = String::new();
    for attempt in &record.attempts {
        let _ = writeln!(text, "{attempt:?}");
    }
    let _ = writeln!(
        text,
        "C/E {:.3}, cost {:.1}, {} runs, {:.1} s",
        found.misfit / problem.expected(&whole),
        found.cost,
        machine.runs(),
        begin.elapsed().as_secs_f64()
    );
    for (k, unknown) in problem.unknowns.iter().enumerate() {
        let _ = writeln!(
            text,
            "{:24} {:+.2} +- {:.2}",
            unknown.name,
            found.xi[k],
            found.standard_error(k).unwrap_or(f64::NAN)
        );
    }
    output::print(&text)
}
