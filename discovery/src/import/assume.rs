//! What is assumed of files about which nobody has said anything: layout, times, units, trigger, conditions.

use std::collections::{BTreeMap, BTreeSet};

use super::clocks::{are_same, clock_of, clocks};
use super::layout::find;
use super::plan::{ColumnPlan, Layout, Plan, ShotPlan};
use super::raw::{Content, Raw, delimiter, text_of};
use super::stamp::{FORMS, Kind};
use super::unit::{clean, heading, unit};
use super::{Asked, RawFile};
use crate::Fault;
use crate::record::{edge, is_two_level};
use hyd_compiler::did_you_mean;

/// Words in the name of a condition that is the number of samples per second.
const RATES: [&str; 4] = ["rate", "abtast", "sampling", "samplefreq"];
/// Longest name of a condition that is read from a preamble.
const LONGEST_NAME: usize = 60;

/// What was assumed of a folder.
pub struct Assumptions {
    /// How its files are read.
    pub plan: Plan,
    /// Sentences on what is not plain, by file.
    pub notes: BTreeMap<String, Vec<String>>,
    /// Files that are no tables, each with the reason.
    pub left_out: Vec<(String, String)>,
}

/// What was assumed of one file.
struct Assumed {
    layout: Layout,
    conditions: BTreeMap<String, f64>,
    /// Sentences on what is not plain.
    notes: Vec<String>,
    /// Headings of columns that look like triggers.
    triggers: BTreeSet<String>,
}

impl Plan {
    /// Assumes how the files are to be read.  A text without rows of numbers is left out where another file is a table.
    ///
    /// # Errors
    /// A sentence with the file and line at fault.
    pub fn assume(name: &str, folder: &str, files: &[RawFile], asked: &Asked) -> Result<Assumptions, Fault> {
        let mut plan = Plan { name: name.to_string(), folder: folder.to_string(), ..Plan::default() };
        let mut notes = BTreeMap::new();
        let mut triggers: Vec<BTreeSet<String>> = Vec::new();
        let mut skipped: BTreeSet<&String> = BTreeSet::new();
        let why_not = |file: &RawFile| match &file.content {
            Content::Text(bytes) => text_of(bytes, None).ok().and_then(|(text, _)| find(&text).err()),
            Content::Columns(_) => None,
        };
        let faults: Vec<Option<Fault>> = files.iter().map(why_not).collect();
        let is_any = faults.iter().any(Option::is_none);
        let (mut tables, mut left_out) = (Vec::new(), Vec::new());
        for (file, fault) in files.iter().zip(faults) {
            match fault.filter(|_| is_any) {
                Some(fault) => left_out.push((file.name.clone(), fault.sentence)),
                None => tables.push(file),
            }
        }
        if let Some(fault) = missing_time(&tables, asked) {
            return Err(fault);
        }
        let numbers = numbers(&tables);
        for (file, number) in tables.iter().zip(numbers) {
            let own = one(&file.content, asked).map_err(|fault| Fault::new(format!("`{}`: {fault}", file.name)))?;
            skipped.extend(asked.skip.iter().filter(|name| is_named(&own.layout, name)));
            notes.insert(file.name.clone(), own.notes);
            let conditions = own.conditions;
            plan.shot.push(ShotPlan { file: file.name.clone(), number, conditions, ..ShotPlan::default() });
            match plan.layout.iter().position(|layout| Layout { files: Vec::new(), ..layout.clone() } == own.layout) {
                Some(k) => {
                    plan.layout[k].files.push(file.name.clone());
                    // A trigger is clear where it is so in all files that are read alike.
                    triggers[k] = triggers[k].intersection(&own.triggers).cloned().collect();
                }
                None => {
                    plan.layout.push(Layout { files: vec![file.name.clone()], ..own.layout });
                    triggers.push(own.triggers);
                }
            }
        }
        if let Some(name) = asked.skip.iter().find(|name| !skipped.contains(name)) {
            return Err(Fault::new(format!("no file has a column `{name}` that could be left out")));
        }
        for (layout, clear) in plan.layout.iter_mut().zip(triggers) {
            layout.trigger = trigger(layout, &clear, asked, &mut notes)?;
        }
        plan.shot.sort_by_key(|shot| shot.number);
        Ok(Assumptions { plan, notes, left_out })
    }
}

/// Is this the heading or the name of a column?
fn is_named(layout: &Layout, name: &str) -> bool {
    layout.times.contains_key(name) || layout.columns.iter().any(|(heading, own)| heading == name || own.name == name)
}

/// The fault of a column of times that was asked for and is in no file.
fn missing_time(files: &[&RawFile], asked: &Asked) -> Option<Fault> {
    let mut headings: BTreeSet<String> = BTreeSet::new();
    for file in files {
        let own = match &file.content {
            Content::Columns(columns) => columns.iter().map(|(name, _)| name.clone()).collect(),
            Content::Text(bytes) => {
                let Ok((text, _)) = text_of(bytes, None) else { continue };
                find(&text).and_then(|own| Raw::of_text(&text, &own)).map_or_else(|_| Vec::new(), |raw| raw.headings)
            }
        };
        headings.extend(own);
    }
    let is_there = |name: &String| headings.iter().any(|own| own == name || heading(own).0 == *name);
    // Files that cannot be read are told as such.
    let name = asked.time.iter().find(|name| !headings.is_empty() && !is_there(name))?;
    let hint = did_you_mean(name, headings.iter().map(String::as_str));
    let names: Vec<&str> = headings.iter().map(String::as_str).collect();
    let hint = hint.unwrap_or_else(|| format!("there are: {}", names.join(", ")));
    Some(Fault::new(format!("no file has a column `{name}` that could hold its times; {hint}")))
}

/// The column of the trigger: the one that was asked for, or the only one that is clear or, of several, is called so.
fn trigger(
    layout: &Layout,
    clear: &BTreeSet<String>,
    asked: &Asked,
    notes: &mut BTreeMap<String, Vec<String>>,
) -> Result<Option<String>, Fault> {
    if asked.no_trigger {
        return Ok(None);
    }
    let used = || layout.columns.iter().filter(|(_, own)| !own.skip);
    if let Some(wanted) = &asked.trigger {
        let found = used().find(|(heading, own)| *heading == wanted || own.name == *wanted);
        return match found {
            Some((heading, _)) => Ok(Some(heading.clone())),
            None => {
                let names: Vec<&str> = used().map(|(heading, _)| heading.as_str()).collect();
                let (file, names) = (layout.files.first().map_or("", String::as_str), names.join(", "));
                Err(Fault::new(format!("`{file}`: it has no column `{wanted}` for the trigger; it has: {names}")))
            }
        };
    }
    let named: Vec<&String> = clear.iter().filter(|name| name.to_lowercase().contains("trig")).collect();
    if let [only] = named.as_slice() {
        return Ok(Some((*only).clone()));
    }
    if clear.len() > 1 {
        let names: Vec<String> = clear.iter().map(|name| format!("`{name}`")).collect();
        let sentence = format!(
            "{} look like triggers; times stay as they are (--trigger COLUMN chooses one)",
            names.join(" and ")
        );
        for file in &layout.files {
            notes.entry(file.clone()).or_default().push(sentence.clone());
        }
    }
    Ok(clear.iter().next().filter(|_| clear.len() == 1).cloned())
}

/// Numbers of shots: the last number in the names of the files where all have one and no two the same, else their order.
fn numbers(files: &[&RawFile]) -> Vec<usize> {
    let last_number = |file: &&RawFile| {
        let stem = file.name.rsplit_once('.').map_or(file.name.as_str(), |(stem, _)| stem);
        let digits: String =
            stem.chars().rev().skip_while(|c| !c.is_ascii_digit()).take_while(char::is_ascii_digit).collect();
        digits.chars().rev().collect::<String>().parse::<usize>().ok().filter(|number| *number < 1_000_000)
    };
    let numbers: Vec<Option<usize>> = files.iter().map(last_number).collect();
    let distinct: BTreeSet<usize> = numbers.iter().flatten().copied().collect();
    if distinct.len() == files.len() {
        return numbers.into_iter().flatten().collect();
    }
    (1..=files.len()).collect()
}

fn one(content: &Content, asked: &Asked) -> Result<Assumed, Fault> {
    let (mut layout, raw) = match content {
        Content::Columns(columns) => (Layout::default(), Raw::of_columns(columns)?),
        Content::Text(bytes) => {
            let (text, encoding) = text_of(bytes, None)?;
            let own = find(&text)?;
            let layout = Layout {
                encoding: encoding.to_string(),
                delimiter: own.delimiter.name().to_string(),
                decimal: own.decimal.to_string(),
                header_line: own.header_line,
                unit_line: own.unit_line,
                first_line: own.first_line,
                ..Layout::default()
            };
            (layout, Raw::of_text(&text, &own)?)
        }
    };
    layout.drop_repeated = asked.drop_repeated;
    let mut notes = Vec::new();
    if layout.header_line == 0 && !layout.delimiter.is_empty() {
        notes.push("no header: columns are called by their number".to_string());
    }
    let mut conditions = conditions(&raw, &layout, &mut notes);
    let parts: Vec<(String, Option<String>)> = (0..raw.headings.len())
        .map(|k| {
            let (name, own) = heading(&raw.headings[k]);
            (name, raw.units.get(k).filter(|unit| !unit.is_empty()).cloned().or(own))
        })
        .collect();
    let is_skipped = |k: usize| {
        let names = [&raw.headings[k], &parts[k].0, &clean(&parts[k].0)];
        asked.skip.iter().any(|name| names.contains(&name))
    };
    for (k, before) in &raw.renamed {
        let own = &raw.headings[*k];
        notes.push(format!("more than one column is called `{before}`: column {} is called `{own}`", k + 1));
    }
    let clocks = clocks((&raw, &parts), &is_skipped, asked, &mut notes);
    times(&mut layout, (&raw, &parts), &clocks, asked, (&mut conditions, &mut notes))?;
    columns(&mut layout, (&raw, &parts), &clocks, &is_skipped, &mut notes)?;
    let mut triggers = BTreeSet::new();
    if layout.time.is_some() || layout.rate.is_some() {
        for (k, values) in raw.columns.iter().enumerate() {
            let is_channel = layout.columns.get(&raw.headings[k]).is_some_and(|column| !column.skip);
            let order: Vec<f64> = (0..values.len()).map(|row| row as f64).collect();
            if is_channel && is_two_level(values) && edge(&order, values).is_some_and(|edge| edge.count == 1) {
                triggers.insert(raw.headings[k].clone());
            }
        }
    }
    Ok(Assumed { layout, conditions, notes, triggers })
}

/// Times or a rate.
fn times(
    layout: &mut Layout,
    (raw, parts): (&Raw, &[(String, Option<String>)]),
    clocks: &[usize],
    asked: &Asked,
    (conditions, notes): (&mut BTreeMap<String, f64>, &mut Vec<String>),
) -> Result<(), Fault> {
    let named = conditions.iter().find(|(name, value)| {
        let name = name.to_lowercase();
        **value > 0.0 && (name == "fs" || RATES.iter().any(|word| name.contains(word)))
    });
    let named = named.map(|(name, value)| (name.clone(), *value));
    layout.rate = asked.rate;
    if layout.rate.is_none() && clocks.is_empty() {
        let Some((name, rate)) = named else {
            let names = raw.headings.join(", ");
            return Err(Fault::new(format!(
                "line {}: no column of times was found among {names}; --time COLUMN names it, or --rate HZ \
                 says how many samples there are per second",
                layout.header_line.max(1)
            )));
        };
        notes.push(format!("no column of times; `{name}` before the header says {rate} samples per second"));
        conditions.remove(&name);
        layout.rate = Some(rate);
    }
    if layout.rate.is_some() {
        for &k in clocks {
            notes.push(format!("the times of `{}` are left out, for --rate is given", raw.headings[k]));
            layout.columns.insert(raw.headings[k].clone(), ColumnPlan { skip: true, ..ColumnPlan::default() });
        }
        return Ok(());
    }
    layout.time = clocks.first().map(|&k| raw.headings[k].clone());
    for &k in clocks {
        if let Some((line, text)) = &raw.texts[k] {
            let column = &raw.headings[k];
            return Err(Fault::new(format!(
                "line {line}, column `{column}`: `{text}` is neither a number of seconds nor like the points in time above it; \
                 points in time are read as {FORMS}"
            )));
        }
        if raw.stamps[k].is_some() {
            let first = if raw.stamps[k] == Some(Kind::Time) { " (after midnight a new day begins)" } else { "" };
            let name = &raw.headings[k];
            notes.push(format!(
                "`{name}` holds points in time: they are read as seconds since the first row of the file{first}"
            ));
            layout.times.insert(name.clone(), 1.0);
            continue;
        }
        let own = parts[k].1.as_ref();
        let scale = own.and_then(|own| unit(own)).filter(|unit| unit.si == "s").map(|unit| unit.scale);
        if scale.is_none() {
            notes.push(format!("no unit of `{}` is stated: seconds", raw.headings[k]));
        }
        layout.times.insert(raw.headings[k].clone(), scale.unwrap_or(1.0));
    }
    Ok(())
}

/// All other columns.
fn columns(
    layout: &mut Layout,
    (raw, parts): (&Raw, &[(String, Option<String>)]),
    clocks: &[usize],
    is_skipped: &dyn Fn(usize) -> bool,
    notes: &mut Vec<String>,
) -> Result<(), Fault> {
    let mut names = BTreeSet::from(["time_s".to_string()]);
    for k in (0..parts.len()).filter(|k| !clocks.contains(k)) {
        let column = raw.headings[k].clone();
        if is_skipped(k) {
            layout.columns.insert(column, ColumnPlan { skip: true, ..ColumnPlan::default() });
            continue;
        }
        if let Some((line, text)) = &raw.texts[k] {
            let sentence = format!(
                "line {line}, column `{column}`: `{text}` is not a number; --skip \"{column}\" leaves the column out"
            );
            return Err(Fault::new(sentence));
        }
        if let Some(kind) = raw.stamps[k] {
            let what =
                if kind == Kind::Day { "dates" } else { "points in time, which are not those of the other columns," };
            notes.push(format!("`{column}` holds {what} and is left out"));
            layout.columns.insert(column, ColumnPlan { skip: true, ..ColumnPlan::default() });
            continue;
        }
        if raw.columns[k].iter().all(|value| value.is_nan()) {
            notes.push(format!("`{column}` holds no values and is left out"));
            layout.columns.insert(column, ColumnPlan { skip: true, ..ColumnPlan::default() });
            continue;
        }
        let from = parts[k].1.clone().unwrap_or_default();
        let known = parts[k].1.as_ref().and_then(|own| unit(own));
        if known.is_none() && parts[k].1.is_some() {
            notes.push(format!("the unit `{from}` of `{column}` is not known: values as they are"));
        }
        let is_si = known.as_ref().is_none_or(|unit| unit.scale == 1.0 && unit.offset == 0.0);
        // `p_bar` in Pa would be misleading.
        let stem = parts[k].0.strip_suffix(&format!("_{from}")).filter(|stem| !is_si && !stem.is_empty());
        let name = clean(stem.unwrap_or(&parts[k].0));
        let name = if name.is_empty() { format!("column_{}", k + 1) } else { name };
        let free =
            (1..).map(|n| if n == 1 { name.clone() } else { format!("{name}_{n}") }).find(|own| !names.contains(own));
        let name = free.unwrap_or(name);
        names.insert(name.clone());
        let clock = clock_of(raw, clocks, k, notes).map(|own| clocks[own]);
        let other = clock.filter(|&clock| clock != clocks[0] && !are_same(raw, clock, clocks[0]));
        let (scale, offset) = known.as_ref().map_or((1.0, 0.0), |unit| (unit.scale, unit.offset));
        let si = known.map_or_else(|| from.clone(), |unit| unit.si);
        let time = other.filter(|_| layout.rate.is_none()).map(|clock| raw.headings[clock].clone());
        layout.columns.insert(column, ColumnPlan { name, unit: si, from, scale, offset, time, skip: false });
    }
    if layout.columns.values().all(|column| column.skip) {
        return Err(Fault::new(format!("line {}: it holds no column besides the times", layout.header_line.max(1))));
    }
    for clock in clocks.iter().skip(1).filter(|_| layout.rate.is_none()) {
        let heading = &raw.headings[*clock];
        let is_same = are_same(raw, *clock, clocks[0]);
        let used = layout.columns.values().filter(|own| own.time.as_ref() == Some(heading)).count();
        notes.push(match (is_same, used) {
            (true, _) => format!("the times of `{heading}` are those of `{}`", raw.headings[clocks[0]]),
            (false, 0) => format!("no column belongs to the times of `{heading}`"),
            (false, _) => format!(
                "`{heading}` are the times of the columns to the right of it: the table has the times of all, with gaps where a \
                 column has no value"
            ),
        });
    }
    Ok(())
}

/// Numbers that stand with a name before the header.
fn conditions(raw: &Raw, layout: &Layout, notes: &mut Vec<String>) -> BTreeMap<String, f64> {
    let mut found = BTreeMap::new();
    let between = delimiter(&layout.delimiter);
    for line in &raw.preamble {
        let line = line.trim().trim_start_matches(['#', '%', '*', '/']).trim();
        let mut marks = vec![':', '='];
        if let super::fields::Delimiter::Character(own) = between {
            marks.insert(0, own);
        }
        let Some((name, value)) = marks.into_iter().find_map(|mark| line.split_once(mark)) else { continue };
        let value = value.trim().trim_end_matches([';', ',', '\t']).trim();
        let (value, after) =
            value.split_once([' ', ';', '\t']).map_or((value, ""), |(value, rest)| (value, rest.trim()));
        let decimal = layout.decimal.chars().next().unwrap_or('.');
        let number = super::fields::number(value, decimal).or_else(|| super::fields::number(value, '.'));
        let (name, own) = heading(name.trim().trim_end_matches([':', '=']));
        let own = if after.is_empty() { own } else { Some(after.trim_matches(['[', ']', '(', ')']).to_string()) };
        let known = own.as_ref().map(|own| unit(own));
        let name = clean(&name);
        let (Some(number), false) = (number.filter(|number| number.is_finite()), matches!(known, Some(None))) else {
            continue;
        };
        if name.is_empty() || name.len() > LONGEST_NAME || matches!(name.as_str(), "file" | "shot") {
            continue;
        }
        let (scale, offset) = known.flatten().map_or((1.0, 0.0), |unit| (unit.scale, unit.offset));
        found.insert(name, super::table::rounded(number * scale + offset));
    }
    if !found.is_empty() {
        let names: Vec<String> = found.iter().map(|(name, value)| format!("{name} = {value:?}")).collect();
        notes.push(format!("before the header: {}", names.join(", ")));
    }
    found
}
