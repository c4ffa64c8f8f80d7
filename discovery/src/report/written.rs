//! The model with what was found: its text with fitted numbers in it, and translated.
//!
//! What was fitted for all shots, and what all of them have in common, is part of the text.  A parameter that a text cannot modify
//! from outside (an element of an array, one that is protected) is left to the files of the shots ([`super::shot_files`]).

use super::parameter_file::literal;
use super::{Folder, Scene, inserts};
use crate::catalogue::Candidate;
use crate::machine::Machine;
use crate::problem::Problem;
use crate::study::initial::StartOf;
use crate::variant::Insert;
use crate::variant::data_files::{DataFiles, settled, watched};
use crate::variant::text_bundle::bundle;
use crate::{Fault, Setup};

/// Folder of the files of shots in that of a report.
pub(super) const SHOTS: &str = "shots";

/// The model with what was found.
pub(super) struct Extended {
    /// The text with all that it needs but the built-in library.
    pub whole: String,
    /// The model itself.
    pub own: String,
    /// Translated.
    pub machine: Machine,
    /// The effects.
    pub candidates: Vec<Candidate>,
    /// Expressions of the channels in it.
    pub channels: Vec<String>,
    /// Data files that it reads.
    pub data: DataFiles,
    /// Names of data files that cannot stand in the folder of the report.
    pub lost: Vec<String>,
    /// When a run begins and ends where nobody says otherwise (s).
    pub span: (f64, f64),
}

impl Extended {
    /// The comparison of this model with the set.  What may be off is meant from the values of the base model as before: those of
    /// the text are fitted ones.
    ///
    /// # Errors
    /// When a parameter that the study names is not there.
    pub(super) fn problem<'a>(&'a self, scene: &Scene<'a>) -> Result<Problem<'a>, Fault> {
        let mut problem = scene.setup.problem(&self.machine, &self.candidates)?;
        let fitted = scene.last.base.problem(scene.setup)?;
        (problem.base, problem.unknowns) = (fitted.base, fitted.unknowns);
        Ok(problem)
    }
}

impl Scene<'_> {
    /// Writes and translates the model.
    pub(super) fn extend(&self, Folder { built_in, taken }: Folder<'_>) -> Result<Extended, Fault> {
        let (setup, workshop) = (self.setup, self.workshop);
        let inserts = inserts(setup, self.last)?;
        let (start, stop) = usual_span(setup);
        let from = if start == 0.0 { String::new() } else { format!("StartTime = {start:e}, ") };
        let origin = super::discovered(&workshop.class, self.findings.status.word(), &setup.bench.name);
        let annotation =
            format!("  annotation(experiment({from}StopTime = {stop:e}, Tolerance = 1e-7), __hyd({origin}));\n");
        let words: Vec<&str> = inserts.iter().map(|insert| &*insert.candidate.effect.words).collect();
        let description = format!("{} with {}", workshop.class, words.join(" and "));
        let (texts, files) = watched(workshop, &DataFiles::new(), &|own| own.texts(&inserts, built_in))?;
        let is_taken = |name: &str| taken.contains(&name) || name.split('/').next() == Some(SHOTS);
        let (rest, data, lost) = settled(&bundle(&texts), &files, &is_taken);
        let translated = |stated: &[Stated]| -> Result<(String, String, Machine), Fault> {
            let own = workshop.extended(&inserts, &description, stated, &annotation);
            let whole = format!("{rest}{own}");
            let (mut model, _) = watched(workshop, &data, &|with| with.translate_whole(&whole, &inserts))?;
            model.keep_units(self.last.base.machine.blocks());
            Ok((whole, own, setup.machine(model)?))
        };
        let (whole, own, machine) = with_most(&self.common()?, &translated)?;
        let channels = workshop.shown(&inserts).channels;
        let candidates = inserts.into_iter().map(|Insert { candidate, .. }| candidate).collect();
        Ok(Extended { whole, own, machine, candidates, channels, data, lost, span: (start, stop) })
    }

    /// Literals of the parameters that have one value in all fitted shots and another one in the base model, but those of effects;
    /// and where states begin.
    fn common(&self) -> Result<Vec<Stated>, Fault> {
        let (setup, last) = (self.setup, self.last);
        let problem = last.base.problem(setup)?;
        let of_effects =
            |k: usize| problem.unknowns.iter().any(|own| own.effect.is_some() && own.places().contains(&k));
        let values: Vec<Vec<f64>> = setup.train.iter().map(|&shot| problem.values(&last.fit.xi, shot)).collect();
        let mut common = Vec::new();
        for (k, place) in problem.places.iter().enumerate().filter(|&(k, _)| !of_effects(k)) {
            let (value, nominal) = (values[0][k], problem.machine.parameter(place.name())?.1);
            // Beginnings of states belong to the shots; a run of the text alone begins as the first one does.
            let is_common = StartOf::is_parameter(place.name())
                || values.iter().all(|own| own[k] == value) && value != nominal && !place.name().contains('[');
            let text = literal(&problem.machine.kind(place), value).filter(|_| is_common);
            common.extend(text.map(|text| (place.name().to_string(), text)));
        }
        Ok(common)
    }
}

/// A parameter by its full name, and its value as a literal.
type Stated = (String, String);
/// Makes something of a model that states some values.
type Make<'a, T> = dyn Fn(&[Stated]) -> Result<T, Fault> + 'a;

/// What is made with all values, or with those that can be stated.
fn with_most<T>(all: &[Stated], make: &Make<'_, T>) -> Result<T, Fault> {
    if let Ok(made) = make(all) {
        return Ok(made);
    }
    let mut stated = Vec::new();
    let mut best = make(&stated)?;
    for one in all {
        stated.push(one.clone());
        match make(&stated) {
            Ok(made) => best = made,
            Err(_) => drop(stated.pop()),
        }
    }
    Ok(best)
}

/// When runs begin, the earliest of all shots, and when the last one ends (s).
fn usual_span(setup: &Setup) -> (f64, f64) {
    let shots = || setup.data.shots.iter().map(|shot| &shot.span);
    let start = shots().map(|span| span.start).fold(f64::INFINITY, f64::min);
    (start, shots().map(|span| span.stop).fold(f64::NEG_INFINITY, f64::max))
}
