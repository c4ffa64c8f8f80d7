//! `hyd discover STUDY.toml --bench SET.json --report DIR`: where do they differ, what is missing, and the model that has it.

use std::fmt::Write;

use hyd_compiler::inquiry::{annotated_classes, annotated_components};
use hyd_discovery::catalogue::{candidates, effects, sites};
use hyd_discovery::search::Search;
use hyd_discovery::variant::Workshop;

use crate::arguments::Discover;
use crate::study::open;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn discover(arguments: &Discover) -> Result<(), Failure> {
    let opened = open(&arguments.study)?;
    let setup = &opened.setup;
    let make = || opened.sources();
    let workshop = Workshop {
        sources: &make,
        preamble: opened.preamble(),
        class: opened.class.clone(),
        channels: setup.expressions(),
    };
    let (classes, ..) = annotated_classes(&mut *opened.sources(), "effect");
    let effects = effects(&classes)?;
    let text = format!("{}model HydPlaces extends {}; end HydPlaces;", opened.preamble(), opened.class);
    let places = annotated_components(&mut *opened.sources(), ("study", &text), Some("HydPlaces"), "place");
    let places = places.map_err(|_| Failure::Fault("the base model cannot be instantiated".into()))?;
    let measured = |name: &str| setup.data.channel(name).is_some();
    let candidates = candidates(&effects, &sites(&places), setup.bench.base_model.as_deref(), &measured);
    eprintln!(
        "{} classes, {} effects, {} places, {} candidates",
        classes.len(),
        effects.len(),
        places.len(),
        candidates.len()
    );
    let begin = std::time::Instant::now();
    let progress = |text: &str| eprintln!("{:6.1} s {text}", begin.elapsed().as_secs_f64());
    let search = Search { setup, workshop: &workshop, candidates, seed: arguments.study.seed, progress: &progress };
    let findings = search.run()?;
    let mut text = String::new();
    for pass in &findings.passes {
        let _ = writeln!(
            text,
            "{}: C/E {:.3} cost {:.1}",
            pass.base.label(),
            pass.fit.misfit / pass.expected,
            pass.fit.cost
        );
        for attempt in &pass.record.attempts {
            let _ = writeln!(text, "   {attempt:?}");
        }
        for tried in &pass.tried {
            let look = tried.look.as_ref();
            let _ = writeln!(
                text,
                "   {:28} look {:9.1} at {:9.2e} power {:9.1} left {:.2} | fall {:9.1} errors {:6.1} C/E {:.3} steps {} {}",
                tried.hypothesis.label(),
                look.map_or(f64::NAN, |l| l.score.gain),
                look.map_or(f64::NAN, |l| l.size * l.score.amplitude),
                look.map_or(f64::NAN, |l| l.score.power),
                look.map_or(f64::NAN, |l| l.score.left),
                tried.fall,
                tried.errors,
                tried.fit.as_ref().map_or(f64::NAN, |f| f.misfit / pass.expected),
                tried.fit.as_ref().map_or(0, |f| f.steps),
                tried.verdict
            );
        }
    }
    let _ = writeln!(
        text,
        "{} {} ambiguous {:?}; {} runs, {:.1} s",
        findings.status.word(),
        findings.passes.last().map_or(String::new(), |p| p.base.label()),
        findings.ambiguous.iter().map(|c| c.label()).collect::<Vec<_>>(),
        findings.runs,
        begin.elapsed().as_secs_f64()
    );
    output::print(&text)
}
