//! A plan followed: tables, the set with what it estimates, a first study, and the words on all of it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::layout::TextLayout;
use super::plan::{Layout, Plan};
use super::raw::{Content, Raw, delimiter, text_of};
use super::starter;
use super::table::{Table, table};
use super::unit::clean;
use crate::Fault;
use crate::record::{Scatter, sampling, scatter};

/// Less scatter than this share of the range is the rounding of what was computed.
const EXACT: f64 = 1e-9;

/// What came of a plan.
pub struct Imported {
    /// Names and texts of the tables.
    pub tables: Vec<(String, String)>,
    /// The set.
    pub set: String,
    /// A first study.
    pub study: String,
    /// What was done, for people.
    pub words: String,
}

/// A channel over all shots.
pub(super) struct Channel {
    /// Its name.
    pub name: String,
    /// Heading in the files.
    pub heading: String,
    /// Its unit.
    pub unit: String,
    /// Smallest and largest value.
    pub range: (f64, f64),
    noises: Vec<f64>,
    /// Number of shots in which the noise is at most that.
    bounds: usize,
    steps: Vec<f64>,
}

impl Plan {
    /// Follows a plan; `read` gives what a file of the folder holds, `notes` are sentences by file.
    ///
    /// # Errors
    /// A sentence with the file and line at fault.
    pub fn carry_out(
        &self,
        notes: &BTreeMap<String, Vec<String>>,
        read: &mut dyn FnMut(&str) -> Result<Content, Fault>,
    ) -> Result<Imported, Fault> {
        let mut channels: Vec<Channel> = Vec::new();
        let (mut tables, mut names, mut words) = (Vec::new(), BTreeSet::new(), String::new());
        let (mut experiments, mut begins, mut periods) = (Vec::new(), Vec::new(), Vec::new());
        let mut before: Option<(&Layout, &str)> = None;
        for shot in &self.shot {
            let wrong = |fault: Fault| Fault::new(format!("`{}`: {fault}", shot.file));
            // A self that was checked has one for each shot.
            let layout =
                self.layout_of(&shot.file).ok_or_else(|| Fault::new(format!("`{}` has no layout", shot.file)))?;
            let raw = raw(&read(&shot.file)?, layout).map_err(wrong)?;
            let own = table(&raw, layout, shot).map_err(wrong)?;
            let name = table_name(&shot.file, &mut names);
            begins.push(own.times[0]);
            periods.extend(sampling(&own.times).map(|own| own.period));
            for column in &own.columns {
                let place = channels.iter().position(|channel| channel.name == column.name).unwrap_or_else(|| {
                    channels.push(Channel::new(&column.name, &column.heading, &column.unit));
                    channels.len() - 1
                });
                channels[place].add(&own.times, &column.values);
            }
            let same = before.filter(|(other, _)| std::ptr::eq(*other, layout)).map(|(_, file)| file);
            say(&mut words, (layout, &raw, &own), (&shot.file, &name), (notes.get(&shot.file), same));
            before = Some((layout, before.filter(|_| same.is_some()).map_or(&shot.file, |(_, file)| file)));
            let mut experiment = Map::new();
            experiment.insert("file".into(), name.clone().into());
            experiment.insert("shot".into(), shot.number.into());
            experiment.extend(shot.conditions.iter().map(|(name, value)| (name.clone(), json!(value))));
            experiments.push(Value::Object(experiment));
            tables.push((name, own.csv()));
        }
        let set = set(self, &channels, experiments, (&begins, &periods), &mut words);
        // A time anywhere within a period has a variance of a twelfth of its square.
        let jitter = middle(&periods).map(|period| three(period / 12.0_f64.sqrt()));
        let has_trigger = self.layout.iter().any(|layout| layout.trigger.is_some());
        let study = starter::study(self, &channels, jitter.filter(|_| has_trigger));
        Ok(Imported { tables, set, study, words })
    }
}

/// The columns of a file by its layout.
fn raw(content: &Content, layout: &Layout) -> Result<Raw, Fault> {
    match content {
        Content::Columns(columns) => Raw::of_columns(columns),
        Content::Text(bytes) => {
            let stated = Some(layout.encoding.as_str()).filter(|name| !name.is_empty());
            let (text, _) = text_of(bytes, stated)?;
            let own = TextLayout {
                delimiter: delimiter(&layout.delimiter),
                decimal: layout.decimal.chars().next().unwrap_or('.'),
                header_line: layout.header_line,
                unit_line: layout.unit_line,
                first_line: layout.first_line.max(1),
            };
            Raw::of_text(&text, &own)
        }
    }
}

/// A name for a table that no other has.
fn table_name(file: &str, names: &mut BTreeSet<String>) -> String {
    let base = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let (stem, ending) = base.rsplit_once('.').unwrap_or((base, ""));
    let stem = clean(stem);
    let stem = if stem.is_empty() { "shot".to_string() } else { stem };
    let all = std::iter::once(format!("{stem}.csv"))
        .chain(std::iter::once(format!("{stem}_{ending}.csv")))
        .chain((2..).map(|n| format!("{stem}_{n}.csv")));
    // The names are endless, and finitely many are taken; letters of another case are no other name on some systems.
    let name = all.into_iter().find(|name| names.insert(name.to_lowercase()));
    name.unwrap_or(stem)
}

impl Channel {
    fn new(name: &str, heading: &str, unit: &str) -> Self {
        Self {
            name: name.to_string(),
            heading: heading.to_string(),
            unit: unit.to_string(),
            range: (f64::INFINITY, f64::NEG_INFINITY),
            noises: Vec::new(),
            bounds: 0,
            steps: Vec::new(),
        }
    }

    /// True where nothing shows how much it scatters.
    pub(super) fn is_silent(&self) -> bool {
        self.noise().is_none()
    }

    /// Step of the numbers in most shots.
    fn step(&self) -> Option<f64> {
        middle(&self.steps).filter(|_| 2 * self.steps.len() > self.noises.len())
    }

    /// Noise without the rounding; zero only where the numbers have a step.
    fn noise(&self) -> Option<f64> {
        let least = EXACT * (self.range.1 - self.range.0);
        middle(&self.noises).filter(|noise| *noise > least || self.step().is_some())
    }

    /// True where the noise is less than what was found.
    fn is_bound(&self) -> bool {
        2 * self.bounds > self.noises.len()
    }

    fn add(&mut self, times: &[f64], values: &[f64]) {
        for value in values.iter().filter(|value| value.is_finite()) {
            self.range = (self.range.0.min(*value), self.range.1.max(*value));
        }
        if let Some(own) = scatter(times, values) {
            self.noises.push(own.without_rounding());
            self.bounds += usize::from(!own.is_settled);
            self.steps.extend(own.step.filter(|step| is_coarse(*step, &own)));
        }
    }
}

/// Is rounding to steps a part of the noise that counts?
fn is_coarse(step: f64, noise: &Scatter) -> bool {
    step > 0.01 * noise.sigma
}

fn middle(numbers: &[f64]) -> Option<f64> {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Three digits are enough for an estimate.
fn three(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

fn set(
    plan: &Plan,
    channels: &[Channel],
    experiments: Vec<Value>,
    (begins, periods): (&[f64], &[f64]),
    words: &mut String,
) -> String {
    let mut stated = plan.set.clone();
    let (mut estimated, mut unknown) = (Vec::new(), Vec::new());
    for channel in channels {
        if !stated.noise_std.contains_key(&channel.name) {
            let step = channel.step();
            match channel.noise() {
                Some(noise) => {
                    stated.noise_std.insert(channel.name.clone(), three(noise));
                    estimated.push(format!("`{}`", channel.name));
                    if let Some(step) = step.filter(|_| !stated.quantisation.contains_key(&channel.name)) {
                        stated.quantisation.insert(channel.name.clone(), three(step));
                    }
                }
                None => unknown.push(format!("`{}`", channel.name)),
            }
        }
    }
    // Plain names and numbers become JSON without fail.
    let mut object = match serde_json::to_value(&stated) {
        Ok(Value::Object(object)) => object,
        _ => Map::new(),
    };
    let mut remarks = Vec::new();
    let _ = writeln!(words);
    if !estimated.is_empty() {
        let names = estimated.join(", ");
        remarks.push(format!(
            "noise_std and quantisation of {names} are estimates from the differences of neighbouring samples"
        ));
        let _ = writeln!(
            words,
            "noise is estimated from the differences of neighbouring samples (state it under [set] if you know it):"
        );
        for channel in channels {
            let name = &channel.name;
            let (Some(noise), true) = (stated.noise_std.get(name), estimated.contains(&format!("`{name}`"))) else {
                continue;
            };
            let step = stated.quantisation.get(name).map_or_else(String::new, |step| format!(", step {step:e}"));
            let bound =
                if channel.is_bound() { "; at most, for it changes too fast between samples to tell" } else { "" };
            let _ = writeln!(words, "  {name}: {noise:e} {}{step}{bound}", channel.unit);
        }
    }
    if !unknown.is_empty() {
        let names = unknown.join(", ");
        remarks.push(format!("no noise is seen in {names}"));
        let _ = writeln!(
            words,
            "no noise is seen in {names}; of what is compared with the model, and is not an input, state it under [set] before a fit"
        );
    }
    object.insert("set".into(), plan.name.clone().into());
    object.insert("channels".into(), channels.iter().map(|own| own.name.clone()).collect::<Vec<_>>().into());
    if !remarks.is_empty() {
        object.insert("remarks".into(), remarks.into());
    }
    let before = begins.iter().fold(f64::INFINITY, |least, begin| least.min(-begin));
    if before > 0.0 && before.is_finite() {
        object.insert("pre_trigger_s".into(), json!(three(before)));
    }
    let (low, high) = periods.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &p| (l.min(p), h.max(p)));
    if high > 0.0 && high < 1.01 * low {
        object.insert("sampling_Hz".into(), json!(three(1.0 / low)));
    }
    object.insert("experiments".into(), experiments.into());
    format!("{:#}\n", Value::Object(object))
}

/// Does a column hold points in time?
fn holds_stamps(raw: &Raw, heading: &str) -> bool {
    let place = raw.headings.iter().position(|own| own == heading);
    place.and_then(|k| raw.stamps.get(k)).is_some_and(Option::is_some)
}

/// Words on one file.
fn say(
    words: &mut String,
    (layout, raw, own): (&Layout, &Raw, &Table),
    (file, name): (&str, &str),
    (notes, same): (Option<&Vec<String>>, Option<&str>),
) {
    // Writing to a string cannot fail.
    let _ = write!(words, "{file} -> {name}: ");
    let rows = own.times.len();
    let (first, last) = (own.times[0], own.times[rows - 1]);
    let zero = own.zero.map(|(zero, found)| {
        let trigger = layout.trigger.as_deref().unwrap_or_default();
        if found { format!("the edge of `{trigger}` at {zero} s is time 0") } else { format!("{zero} s is time 0") }
    });
    let zero = zero.map_or_else(String::new, |zero| format!("; {zero}"));
    let repeated = match own.repeated {
        0 => String::new(),
        1 => "; 1 row is left out, for its time is that of the row before".to_string(),
        many => format!("; {many} rows are left out, for their times are those of the rows before"),
    };
    let span = format!("{rows} rows from {first} to {last} s{zero}{repeated}");
    match same {
        Some(other) => {
            let _ = writeln!(words, "like {other}; {span}");
        }
        None => {
            if layout.delimiter.is_empty() {
                let _ = writeln!(words, "names and numbers of the file; {span}");
            } else {
                let between = delimiter(&layout.delimiter).words();
                let decimal = if layout.decimal == "," { "decimal commas" } else { "decimal points" };
                let header = match (layout.header_line, layout.unit_line) {
                    (0, _) => "no header".to_string(),
                    (header, 0) => format!("header in line {header}"),
                    (header, units) => format!("header in line {header}, units in line {units}"),
                };
                let encoding = &layout.encoding;
                let _ = writeln!(words, "{between} between fields, {decimal}, {encoding}, {header}; {span}");
            }
            match (&layout.time, layout.rate) {
                (Some(time), _) if holds_stamps(raw, time) => {
                    let _ = writeln!(words, "  times: `{time}`, seconds since the first row");
                }
                (Some(time), _) => {
                    let scale = layout.times.get(time).copied().unwrap_or(1.0);
                    let _ = writeln!(words, "  times: `{time}`, {scale} s per unit");
                }
                (None, Some(rate)) => {
                    let _ = writeln!(words, "  times: {rate} samples per second, the first at 0");
                }
                (None, None) => {}
            }
            for heading in &raw.headings {
                let Some(column) = layout.columns.get(heading) else { continue };
                let unit = if column.unit.is_empty() { "no unit".to_string() } else { column.unit.clone() };
                let mut how = String::new();
                if column.scale != 1.0 {
                    let _ = write!(how, ", times {:e}", column.scale);
                }
                if column.offset != 0.0 {
                    let _ = write!(how, ", plus {}", column.offset);
                }
                let _ = if column.skip {
                    writeln!(words, "  `{heading}` is left out")
                } else {
                    writeln!(words, "  `{heading}` -> {} in {unit}{how}", column.name)
                };
            }
            if layout.trigger.is_none() && own.zero.is_none() {
                let _ = writeln!(words, "  no trigger: times stay (--trigger COLUMN, or `trigger` in the import file)");
            }
        }
    }
    for note in notes.into_iter().flatten() {
        let _ = writeln!(words, "  {note}");
    }
}
