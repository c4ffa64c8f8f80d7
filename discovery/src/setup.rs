//! A study and a set put together: which parameters are set in which shot, and what may be off.
//!
//! Conditions decide parameters shot by shot; nuisances are relative to those values.  A nuisance whose tolerance neither the set
//! nor the study states is not a nuisance.  Shots are divided into those that are fitted and those that are held out: by default
//! those at the centre of the operating points, so that what is foretold lies between what was seen.

use std::sync::Arc;

use hyd_system::{DaeSystem, InputSite};

use crate::bench::operating_points::{are_several, central};
use crate::bench::recorded::{ShotInputs, early_starts, idle};
use crate::bench::windows;
use crate::catalogue::Candidate;
use crate::data::Data;
use crate::disturbance::{Added, Disturbances, Lag, ROOM};
use crate::machine::foreign::Foreign;
use crate::machine::{Machine, ParameterPlace};
use crate::magnitude::{is_plausible, shown};
use crate::problem::Problem;
use crate::study::formula::evaluate;
use crate::study::initial::{Initial, StartOf};
use crate::study::{Nuisance, Shots};
use crate::unknowns::limits::limit;
use crate::unknowns::prior::Prior;
use crate::unknowns::{EffectPart, Meaning, Unknown};
use crate::variant::translated::Translated;
use crate::{Bench, Fault, Study, Watch};

/// States without a beginning that are named.
const MOST_STATES: usize = 4;

/// A study and a set.
pub struct Setup {
    /// The study.
    pub study: Study,
    /// The set.
    pub bench: Bench,
    /// Its shots made ready.
    pub data: Data,
    /// Shots that are fitted.
    pub train: Vec<usize>,
    /// Shots that are held out.
    pub held_out: Vec<usize>,
    /// Shots that were held out at first and are fitted now, because they showed what the others hide.
    pub exposed: Vec<usize>,
    /// What disturbs the bench beside its stated noise.
    pub disturbances: Disturbances,
    /// Number of threads.
    pub threads: usize,
    /// Who runs units of other tools that are blocks of the model, if anybody does.
    pub foreign: Option<Foreign>,
    /// How often runs were done again, and whether the work is to end.
    pub watch: Watch,
}

/// Parameters that are set for every run, and their values under the conditions of each shot.
struct PlaceList<'a> {
    machine: &'a Machine,
    names: Vec<String>,
    places: Vec<ParameterPlace>,
    base: Vec<Vec<f64>>,
}

impl PlaceList<'_> {
    /// Position of a parameter; one that is new gets the value that `value_of` makes of shot and declared value.  `by`:
    /// who names it.
    fn add(
        &mut self,
        name: &str,
        by: &dyn Fn() -> String,
        value_of: &dyn Fn(usize, f64) -> Result<f64, Fault>,
    ) -> Result<usize, Fault> {
        if let Some(known) = self.names.iter().position(|known| known == name) {
            return Ok(known);
        }
        let found = self.machine.parameter(name);
        let (place, nominal) = found.map_err(|fault| Fault::new(format!("{}: {fault}", by())))?;
        for (shot, values) in self.base.iter_mut().enumerate() {
            values.push(value_of(shot, nominal)?);
        }
        self.places.push(place);
        self.names.push(name.to_string());
        Ok(self.names.len() - 1)
    }
}

impl Setup {
    /// Puts a study and a set together.
    ///
    /// # Errors
    /// A sentence on what does not fit.
    pub fn new(study: Study, bench: Bench, threads: usize) -> Result<Self, Fault> {
        let held_out = match &study.shots.hold_out {
            Some(numbers) => {
                let position = |&number: &usize| {
                    if bench.shots.iter().filter(|shot| shot.number == number).count() > 1 {
                        let place = study.place(&["shots", "hold_out"]);
                        let sentence =
                            format!("{place}`hold_out` names shot {number}, and several shots have this number");
                        return Err(Fault::new(sentence));
                    }
                    let found = bench.shots.iter().position(|shot| shot.number == number);
                    found.ok_or_else(|| {
                        let place = study.place(&["shots", "hold_out"]);
                        Fault::new(format!("{place}`hold_out` names shot {number}, which the set does not have"))
                    })
                };
                numbers.iter().map(position).collect::<Result<Vec<_>, _>>()?
            }
            None => central(&study, &bench, &[]),
        };
        let mut study = study;
        // It counts in periods of the recorder.
        study.shots.time_tolerance /= bench.averaged.max(1) as f64;
        Self::with_held_out(study, bench, threads, held_out)
    }

    /// The same with these shots held out.
    fn with_held_out(study: Study, bench: Bench, threads: usize, held_out: Vec<usize>) -> Result<Self, Fault> {
        let data = Data::new(&bench, &study)?;
        let mut study = study;
        if study.states_no_time_tolerance() {
            study.shots.time_tolerance = data.affordable(study.shots.time_tolerance);
        }
        let train: Vec<usize> = (0..bench.shots.len()).filter(|shot| !held_out.contains(shot)).collect();
        if train.is_empty() {
            return Err(Fault::new("all shots are held out, so that none is left to fit"));
        }
        let counts = |&shot: &usize| {
            let traces = data.shots[shot].traces.iter().flatten();
            traces.flat_map(|trace| &trace.used).any(|used| *used)
        };
        for (shots, words) in [(&train, "fitted"), (&held_out, "held out")] {
            if !shots.is_empty() && !shots.iter().any(counts) {
                let words = format!("no sample of the shots that are {words} counts: all are missing or masked");
                return Err(Fault::new(words));
            }
        }
        let (exposed, disturbances, watch) = (Vec::new(), Disturbances::default(), Watch::default());
        let foreign = None;
        Ok(Self { study, bench, data, train, held_out, exposed, disturbances, threads, foreign, watch })
    }

    /// What the user should know of the study beside this set.
    pub fn warnings(&self) -> Vec<String> {
        let idle = self.data.idle_masks.iter().map(|mask| {
            let place = self.study.place(&["shots", "masks", &mask.to_string()]);
            format!("{place}the mask leaves out no sample of any shot")
        });
        let starts: Vec<f64> = self.data.shots.iter().map(|shot| shot.span.start).collect();
        idle.chain(early_starts(&self.study, &self.bench.shots, &starts)).collect()
    }

    /// The same with other shots held out and those of now fitted; none where the study says which are held out, or where too
    /// few are left.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn exchanged(&self) -> Result<Option<Self>, Fault> {
        if self.study.shots.hold_out.is_some() || self.held_out.is_empty() || self.train.len() < 2 {
            return Ok(None);
        }
        let mut study = self.study.clone();
        let others = central(&study, &self.bench, &self.held_out);
        study.shots.hold_out = Some(others.iter().map(|&shot| self.bench.shots[shot].number).collect());
        let mut setup = Self::with_held_out(study, self.bench.clone(), self.threads, others)?;
        setup.exposed.clone_from(&self.held_out);
        setup.watch = self.watch.clone();
        setup.foreign.clone_from(&self.foreign);
        setup.data.disturb(&self.disturbances);
        setup.disturbances = self.disturbances.clone();
        Ok(Some(setup))
    }

    /// The same with these disturbances taken up.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn disturbed(&self, disturbances: Disturbances) -> Result<Self, Fault> {
        let (study, bench) = (self.study.clone(), self.bench.clone());
        let mut setup = Self::with_held_out(study, bench, self.threads, self.held_out.clone())?;
        setup.exposed.clone_from(&self.exposed);
        setup.watch = self.watch.clone();
        setup.foreign.clone_from(&self.foreign);
        setup.data.disturb(&disturbances);
        setup.disturbances = disturbances;
        Ok(setup)
    }

    /// Expressions of the channels that are measured.
    pub fn expressions(&self) -> Vec<String> {
        self.data.channels.iter().map(|channel| channel.expression.clone()).collect()
    }

    /// A machine for a translated model with the channels of the set.
    ///
    /// # Errors
    /// When the model cannot be bound.
    pub fn machine(&self, model: Translated) -> Result<Machine, Fault> {
        self.machine_of(model, self.data.channels.len())
    }

    /// A machine for a translated model with so many channels.
    pub(crate) fn machine_of(&self, model: Translated, channels: usize) -> Result<Machine, Fault> {
        if self.watch.stopped() {
            return Err(Fault::run("interrupted"));
        }
        let inputs = self.inputs(&model)?;
        let counts = (self.threads, &self.watch);
        Machine::new(model, (channels, inputs), self.study.run.tolerance, counts, self.foreign.as_ref())
    }

    /// The recorded inputs of a model.
    fn inputs(&self, model: &Translated) -> Result<Arc<ShotInputs>, Fault> {
        let system = model.model.instantiate();
        let of_unit = |site: &InputSite| {
            model.blocks.iter().any(|block| block.outputs.iter().any(|(name, _)| *name == *site.name))
        };
        let sites: Vec<InputSite> = system.structure().inputs.iter().filter(|site| !of_unit(site)).cloned().collect();
        ShotInputs::new(&self.study, &self.bench.shots, (&sites, &system), &model.inputs).map(Arc::new)
    }

    /// Sentences on inputs of a model that nothing drives.
    pub fn idle_inputs(&self, model: &Translated) -> Vec<String> {
        idle(&self.study, &model.inputs)
    }

    /// Names of the inputs of the model that follow columns.
    pub fn driven(&self) -> Vec<String> {
        self.study.inputs.keys().cloned().collect()
    }

    /// States whose beginning the study sets.
    pub fn starts(&self) -> Vec<StartOf> {
        let of = |(state, initial): (&String, &Initial)| StartOf {
            state: state.clone(),
            at_rest: initial.formula().is_none(),
        };
        self.study.initial.iter().map(of).collect()
    }

    /// What was decided for the user: which part of which table is which shot, and a tolerance of time that nobody has stated.
    pub fn notes(&self) -> Vec<String> {
        let tolerance = self.study.shots.time_tolerance * self.bench.averaged.max(1) as f64;
        let is_lowered = self.study.states_no_time_tolerance() && tolerance < Shots::default().time_tolerance;
        let lowered = is_lowered.then(|| {
            format!(
                "these records move all the time, so that times are taken to be right within {tolerance} sample periods; \
                 `time_tolerance` in `[shots]` says otherwise"
            )
        });
        let averaged = (self.bench.averaged > 1).then(|| {
            format!(
                "each {} rows of the tables are averaged to one: between them nothing changes by more than noise hides (`average = 1` in `[shots]` keeps every row)",
                self.bench.averaged
            )
        });
        let averaged = averaged.filter(|_| self.study.shots.average.is_none());
        let is_window = self.bench.shots.iter().any(|shot| shot.is_window);
        let own_starts = (is_window && self.study.shots.windows.is_none()).then(|| {
            "each window begins in states of its own, which take up what changes slowly over several of them: `windows` in `[shots]` says how many \
             there are, and 1 leaves the record whole"
                .to_string()
        });
        averaged.into_iter().chain(windows::told(&self.bench.shots)).chain(own_starts).chain(lowered).collect()
    }

    /// Sentences on states that begin with the first value of a channel that shows something else than the state.
    pub fn other_starts(&self) -> Vec<String> {
        let sentence = |(state, initial): (&String, &Initial)| {
            let name = initial.formula()?.trim().strip_prefix("first_")?;
            let channel = self.study.channels.get(name)?;
            let shown = channel.variable.trim();
            // What is shifted or scaled by a number is another value than the state, whatever the names mean.
            let is_shifted = shown.contains(['+', '-', '*', '/']) && shown.contains(|c: char| c.is_ascii_digit());
            is_shifted.then(|| {
                format!(
                    "{}the state `{state}` begins at `first_{name}`, but that channel shows `{shown}`: if the two differ, the formula has to undo it",
                    self.study.place(&["initial", state])
                )
            })
        };
        self.study.initial.iter().filter_map(sentence).collect()
    }

    /// Sentences on states of a model that begin every window of a record at their declared value, as the study says nothing of them.
    pub fn unset_states(&self, model: &Translated) -> Option<String> {
        if !self.bench.shots.iter().any(|shot| shot.is_window) {
            return None;
        }
        let system = model.model.instantiate();
        let tables = system.tables();
        let place = |name: &str| {
            let (variable, element) = tables.find(name)?;
            variable.sources.get(element).map(|source| source.place)
        };
        // A state may be set by another of its names.
        let is_set = |name: &str| {
            self.study
                .initial
                .keys()
                .any(|known| known == name || place(known).is_some_and(|own| place(name) == Some(own)))
        };
        let states = system.structure().differential.iter().enumerate().filter(|(_, is_state)| **is_state);
        let names: Vec<String> = states.map(|(k, _)| tables.unknown_name(k)).filter(|name| !is_set(name)).collect();
        let shown: Vec<String> = names.iter().take(MOST_STATES).map(|name| format!("`{name}`")).collect();
        let more = match names.len().saturating_sub(MOST_STATES) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let begin = if names.len() == 1 { "begins" } else { "begin" };
        (!names.is_empty()).then(|| {
            format!(
                "the record is cut into windows, and {}{more} {begin} each of them as the model says: `[initial]` says where they are then (or `windows = 1` in \
                 `[shots]` leaves the record whole)",
                shown.join(", ")
            )
        })
    }

    /// The comparison of a model with these effects in it.
    ///
    /// # Errors
    /// When a parameter that the study names is not there.
    pub fn problem<'a>(&'a self, machine: &'a Machine, inserts: &[Candidate]) -> Result<Problem<'a>, Fault> {
        let base = vec![Vec::new(); self.data.shots.len()];
        let mut list = PlaceList { machine, names: Vec::new(), places: Vec::new(), base };
        for (name, formula) in &self.study.conditions {
            let by = || "`[conditions]` of the study".to_string();
            let place = || self.study.place(&["conditions", name]);
            list.add(name, &by, &|shot, _| {
                let shot = &self.bench.shots[shot];
                let value = evaluate(formula, &|condition| shot.conditions.get(condition).copied())
                    .map_err(|fault| Fault::new(format!("{}shot {}: {fault}", place(), shot.number)))?;
                let too_large = || {
                    let (place, number, value) = (place(), shot.number, shown(value));
                    Fault::new(format!("{place}shot {number}: `{name}` becomes {value} by the formula `{formula}`, larger than any parameter"))
                };
                if is_plausible(value) { Ok(value) } else { Err(too_large()) }
            })?;
        }
        let mut unknowns = Vec::new();
        for (state, initial) in &self.study.initial {
            self.initial(state, initial, &mut list, &mut unknowns)?;
        }
        for (label, nuisance) in &self.study.nuisances {
            let by = || format!("`{label}` in `[nuisances]` of the study");
            let at = list.add(nuisance.parameter(), &by, &|_, nominal| {
                let place = || self.study.place(&["nuisances", label]);
                let (parameter, value) = (nuisance.parameter(), shown(nominal));
                let too_large =
                    || format!("{}`{parameter}` is {value} in the model, larger than any parameter", place());
                if is_plausible(nominal) { Ok(nominal) } else { Err(Fault::new(too_large())) }
            })?;
            self.nuisance(label, nuisance, at, &list, &mut unknowns);
        }
        let nuisances = unknowns.len();
        self.scatter(&mut unknowns);
        self.chains(&mut unknowns);
        self.courses(&mut unknowns);
        self.clocks(&mut unknowns);
        self.triggers(&list, &mut unknowns)?;
        self.refuse_same_names(&unknowns, nuisances)?;
        for (number, insert) in inserts.iter().enumerate() {
            self.effect(number, insert, &mut list, &mut unknowns)?;
        }
        let mut problem =
            Problem { machine, data: &self.data, places: list.places, base: list.base, unknowns, lender: None };
        limit(&mut problem);
        Ok(problem)
    }

    /// The beginning of a state, shot by shot.
    fn initial(
        &self,
        state: &str,
        initial: &Initial,
        list: &mut PlaceList<'_>,
        unknowns: &mut Vec<Unknown>,
    ) -> Result<(), Fault> {
        let Some(formula) = initial.formula() else { return Ok(()) };
        let by = || "`[initial]` of the study".to_string();
        let at = list.add(&StartOf::parameter(state), &by, &|shot, _| {
            let shot = &self.bench.shots[shot];
            let wrong = |sentence: String| {
                let place = self.study.place(&["initial", state]);
                Fault::new(format!("{place}shot {}: {sentence}", shot.number))
            };
            let value = evaluate(formula, &|condition| shot.conditions.get(condition).copied());
            let value = value.map_err(|fault| wrong(fault.sentence))?;
            let too_large = || wrong(format!("`{state}` begins at {}, larger than any variable", shown(value)));
            if is_plausible(value) { Ok(value) } else { Err(too_large()) }
        })?;
        for (shot, values) in list.base.iter().enumerate().filter(|_| initial.absolute().is_some()) {
            let prior = Prior::Normal(values[at], initial.absolute().unwrap_or_default());
            let meaning = Meaning::Value { places: vec![at], prior };
            let name = self.named(&format!("{state} at the beginning"), Some(shot));
            unknowns.push(Unknown::new(name, meaning, Some(shot), None));
        }
        Ok(())
    }

    fn nuisance(&self, label: &str, nuisance: &Nuisance, at: usize, list: &PlaceList<'_>, unknowns: &mut Vec<Unknown>) {
        let stated = self.bench.tolerance.get(label).copied();
        let (relative, absolute, per_shot) = match nuisance {
            Nuisance::Parameter(_) => (stated, None, false),
            Nuisance::Stated(own) => (stated.or(own.relative), own.absolute, own.per_shot),
        };
        let shots: Vec<Option<usize>> =
            if per_shot { (0..self.data.shots.len()).map(Some).collect() } else { vec![None] };
        for shot in shots {
            let meaning = match (relative, absolute) {
                (Some(sigma), _) if sigma > 0.0 => Meaning::Relative { places: vec![at], sigma },
                (_, Some(sigma)) if sigma > 0.0 => {
                    let centre = list.base[shot.unwrap_or(0)][at];
                    Meaning::Value { places: vec![at], prior: Prior::Normal(centre, sigma) }
                }
                _ => continue,
            };
            unknowns.push(Unknown::new(self.named(label, shot), meaning, shot, None));
        }
    }

    /// Refuses a nuisance that is called like what else is fitted: nobody could tell them apart.
    fn refuse_same_names(&self, unknowns: &[Unknown], nuisances: usize) -> Result<(), Fault> {
        let (own, others) = unknowns.split_at(nuisances);
        let Some(same) = own.iter().find(|own| others.iter().any(|other| other.name == own.name)) else {
            return Ok(());
        };
        let label = self.study.nuisances.keys().find(|label| same.name.starts_with(*label));
        let place = label.map_or_else(String::new, |label| self.study.place(&["nuisances", label]));
        let name = &same.name;
        Err(Fault::new(format!(
            "{place}the name `{name}` is that of a number which is fitted anyway; call the nuisance otherwise"
        )))
    }

    fn named(&self, label: &str, shot: Option<usize>) -> String {
        match shot {
            Some(shot) => format!("{label} (shot {})", self.data.shots[shot].number),
            None => label.to_string(),
        }
    }

    /// Offsets and gains of the channels.
    fn chains(&self, unknowns: &mut Vec<Unknown>) {
        for (channel, info) in self.data.channels.iter().enumerate() {
            if info.offset > 0.0 {
                let meaning = Meaning::Offset { channel, sigma: info.offset };
                unknowns.push(Unknown::new(format!("offset of {}", info.name), meaning, None, None));
            }
            if info.gain > 0.0 {
                let meaning = Meaning::Gain { channel, sigma: info.gain };
                unknowns.push(Unknown::new(format!("gain of {}", info.name), meaning, None, None));
            }
        }
    }

    /// What parameters differ from shot to shot, by the nuisance that holds for all shots.
    fn scatter(&self, unknowns: &mut Vec<Unknown>) {
        for own in &self.disturbances.scatter {
            let of_all = unknowns.iter().find(|unknown| unknown.name == own.label && unknown.shot.is_none());
            let Some(places) = of_all.map(|unknown| unknown.places().to_vec()) else { continue };
            for shot in 0..self.data.shots.len() {
                let meaning = Meaning::Relative { places: places.clone(), sigma: own.sigma };
                let name = self.named(&format!("scatter of {}", own.label), Some(shot));
                unknowns.push(Unknown::new(name, meaning, Some(shot), None));
            }
        }
    }

    /// What measuring chains add.
    fn courses(&self, unknowns: &mut Vec<Unknown>) {
        for own in &self.disturbances.added {
            let (channel, sigma) = (own.channel, own.sigma);
            let (words, parts) = match own.added {
                Added::Drift => ("drift".to_string(), [" at the middle", ""]),
                Added::Hum(frequency) => (format!("hum of {frequency} Hz"), ["", ", quadrature"]),
            };
            for (shot, data) in self.data.shots.iter().enumerate().filter(|(_, data)| data.traces[channel].is_some()) {
                let name = self.named(&format!("{words} of {}", self.data.channels[channel].name), Some(shot));
                let courses = own.added.courses((data.times[0], data.times[data.times.len() - 1]));
                for (course, part) in courses.into_iter().zip(parts) {
                    let meaning = Meaning::Course { channel, course, sigma };
                    unknowns.push(Unknown::new(format!("{name}{part}"), meaning, Some(shot), None));
                }
            }
        }
    }

    /// Channels that lag, and a clock that runs fast.
    fn clocks(&self, unknowns: &mut Vec<Unknown>) {
        for &Lag { channel, time } in &self.disturbances.lags {
            let meaning = Meaning::Lag { channel, sigma: ROOM * time.abs() };
            unknowns.push(Unknown::new(format!("lag of {}", self.data.channels[channel].name), meaning, None, None));
        }
        let clock = self.disturbances.clock.map(|part| Meaning::Clock { sigma: ROOM * part.abs() });
        unknowns.extend(clock.map(|meaning| Unknown::new("clock of the records".to_string(), meaning, None, None)));
    }

    /// The delays of the shots.
    fn triggers(&self, list: &PlaceList<'_>, unknowns: &mut Vec<Unknown>) -> Result<(), Fault> {
        let Shots { trigger_jitter: sigma, trigger_moves: moved, .. } = &self.study.shots;
        let place = |name: &String| {
            let known = list.names.iter().position(|known| known == name && self.study.conditions.contains_key(name));
            known.ok_or_else(|| {
                Fault::new(format!("`trigger_moves` of the study names `{name}`, which is none of its conditions"))
            })
        };
        let places: Vec<usize> = moved.iter().map(place).collect::<Result<_, _>>()?;
        for shot in (0..self.data.shots.len()).filter(|_| *sigma > 0.0) {
            let (name, meaning) =
                (self.named("trigger", Some(shot)), Meaning::Late { places: places.clone(), sigma: *sigma });
            unknowns.push(Unknown::new(name, meaning, Some(shot), None));
        }
        Ok(())
    }

    /// The parameters of an effect.
    fn effect(
        &self,
        number: usize,
        insert: &Candidate,
        list: &mut PlaceList<'_>,
        unknowns: &mut Vec<Unknown>,
    ) -> Result<(), Fault> {
        let effect = &insert.effect;
        let scale = self.scale(insert);
        for (k, parameter) in effect.parameters.iter().enumerate() {
            let mut places = Vec::new();
            for site in &insert.sites {
                let name = format!("{}.{}", insert.component(site), parameter.name);
                let by = || format!("effect `{}` ({}:{}) in `{}`", effect.id, effect.file, effect.line, site.path);
                places.push(list.add(&name, &by, &|_, nominal| Ok(nominal))?);
            }
            let per_shot = k == 0 && effect.per_shot;
            let prior = match parameter.prior {
                // The first shot may be all but free of what grows from shot to shot.
                Prior::Lognormal(median, _) if per_shot => Prior::Normal(median, median),
                Prior::Normal(m, s) => Prior::Normal(m * scale, s * scale),
                other => other,
            };
            let shots: Vec<Option<usize>> =
                if per_shot { (0..self.data.shots.len()).map(Some).collect() } else { vec![None] };
            for shot in shots {
                let name = self.named(&format!("{}.{}", effect.id, parameter.name), shot);
                let meaning = Meaning::Value { places: places.clone(), prior };
                let effect = Some(EffectPart { effect: number, parameter: k });
                unknowns.push(Unknown::new(name, meaning, shot, effect));
            }
        }
        Ok(())
    }

    /// True if the shots were made under more than one condition.
    pub fn has_several_operating_points(&self) -> bool {
        are_several(&self.study, &self.bench)
    }

    /// By how much the sizes of an effect are to be multiplied.
    pub fn scale(&self, insert: &Candidate) -> f64 {
        let channel = insert.sites.first().and_then(|site| site.channel.as_ref());
        let channel = channel.filter(|_| insert.effect.of_range).and_then(|name| self.data.channel(name));
        channel.map_or(1.0, |channel| self.data.channels[channel].range)
    }
}
