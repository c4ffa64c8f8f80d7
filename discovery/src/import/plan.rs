//! The import file: every assumption about a folder of files as a key, read from TOML and written as TOML.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use hyd_compiler::did_you_mean;
use serde::{Deserialize, Serialize};

use super::decode::ENCODINGS;
use super::fields::Delimiter;
use crate::Fault;
use crate::magnitude::{is_plausible, shown};
use crate::study::study_check::{line, unreadable};

/// Longest text of an import file (bytes).
const LONGEST: usize = 4 << 20;

/// What is assumed about a folder of files.
#[derive(Deserialize, Clone, PartialEq, Debug, Default)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the set.
    pub name: String,
    /// Folder of the files, relative to the import file.
    pub folder: String,
    /// What the lab states of its bench.
    #[serde(default)]
    pub set: Stated,
    /// Files that are read alike.
    pub layout: Vec<Layout>,
    /// Shots in their order.
    pub shot: Vec<ShotPlan>,
}

/// What the lab states, as in a set.
#[derive(Deserialize, Serialize, Clone, PartialEq, Debug, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Stated {
    /// Which model of the study the set belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_model: Option<String>,
    /// Standard deviation of the noise by channel, in the units of the tables; estimated where there is none.
    pub noise_std: BTreeMap<String, f64>,
    /// Step of the numbers by channel; estimated where there is none.
    pub quantisation: BTreeMap<String, f64>,
    /// Standard deviation of offsets by channel.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub sensor_offset_1sigma: BTreeMap<String, f64>,
    /// Relative standard deviation of the gains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor_gain_1sigma: Option<f64>,
    /// Relative standard deviation of parameters.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameter_tolerance_1sigma: BTreeMap<String, f64>,
}

/// Files that are read alike.
#[derive(Deserialize, Clone, PartialEq, Debug, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Layout {
    /// Names in the folder.
    pub files: Vec<String>,
    /// `utf-8`, `latin-1`, `utf-16le` or `utf-16be`.
    pub encoding: String,
    /// `;`, `,`, tab, `|`, or a blank for any number of blanks.
    pub delimiter: String,
    /// `.` or `,`.
    pub decimal: String,
    /// Line of the header, from 1; 0 for none.
    pub header_line: usize,
    /// Line of the units, from 1; 0 for none.
    pub unit_line: usize,
    /// First line of numbers, from 1.
    pub first_line: usize,
    /// Column of times.
    pub time: Option<String>,
    /// Columns of times and the seconds per unit of each.
    pub times: BTreeMap<String, f64>,
    /// Samples per second where there is no column of times.
    pub rate: Option<f64>,
    /// Column whose first edge becomes time 0.
    pub trigger: Option<String>,
    /// Rows whose time is that of the row before are left out.
    pub drop_repeated: bool,
    /// Columns by their heading.
    pub columns: BTreeMap<String, ColumnPlan>,
}

/// What becomes of a column.
#[derive(Deserialize, Clone, PartialEq, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct ColumnPlan {
    /// Its name in the tables that are written.
    pub name: String,
    /// Its unit there.
    pub unit: String,
    /// Its unit in the file, a remark.
    pub from: String,
    /// Value that is written = scale * value of the file + offset.
    pub scale: f64,
    /// See `scale`.
    pub offset: f64,
    /// Column of its times where that is not the layout's.
    pub time: Option<String>,
    /// It is left out.
    pub skip: bool,
}

impl Default for ColumnPlan {
    fn default() -> Self {
        Self {
            name: String::new(),
            unit: String::new(),
            from: String::new(),
            scale: 1.0,
            offset: 0.0,
            time: None,
            skip: false,
        }
    }
}

/// A shot.
#[derive(Deserialize, Clone, PartialEq, Debug, Default)]
#[serde(deny_unknown_fields)]
pub struct ShotPlan {
    /// Name of its file in the folder.
    pub file: String,
    /// Its number.
    pub number: usize,
    /// Time of the file that becomes 0 (s), where no column of the trigger says it.
    pub zero: Option<f64>,
    /// Time of the file (s) at which the shot begins; earlier rows are left out.
    pub begin: Option<f64>,
    /// Time of the file (s) at which it ends; later rows are left out.
    pub end: Option<f64>,
    /// What was recorded beside the channels.
    #[serde(default)]
    pub conditions: BTreeMap<String, f64>,
}

impl Plan {
    /// Reads an import file.
    ///
    /// # Errors
    /// A sentence with the line at fault.
    pub fn parse(text: &str) -> Result<Self, Fault> {
        if text.len() > LONGEST {
            return Err(Fault::new(format!(
                "it has more than {} MB, which is too long for an import file",
                LONGEST >> 20
            )));
        }
        let plan: Plan = toml::from_str(text).map_err(|error| unreadable(text, &error))?;
        plan.check(text)?;
        Ok(plan)
    }

    fn check(&self, text: &str) -> Result<(), Fault> {
        let at = |keys: &[&str], sentence: String| {
            let place = line(text, keys).map_or_else(String::new, |line| format!("line {line}: "));
            Fault::new(format!("{place}{sentence}"))
        };
        for (k, own) in self.layout.iter().enumerate() {
            let k = k.to_string();
            let wrong = |key: &str, sentence: String| at(&["layout", &k, key], sentence);
            if !own.encoding.is_empty() && !ENCODINGS.contains(&own.encoding.as_str()) {
                let names = ENCODINGS.join(", ");
                return Err(wrong("encoding", format!("`{}` is not one of the encodings {names}", own.encoding)));
            }
            if !own.delimiter.is_empty() && Delimiter::of(&own.delimiter).is_none() {
                let sentence =
                    format!("the delimiter {:?} is not one of `;`, `,`, `|`, a tab and a blank", own.delimiter);
                return Err(wrong("delimiter", sentence));
            }
            if !matches!(own.decimal.as_str(), "" | "." | ",") {
                return Err(wrong("decimal", format!("the decimal mark is `{}`, and must be `.` or `,`", own.decimal)));
            }
            if own.time.is_none() == own.rate.is_none() {
                let sentence =
                    "a layout has either `time`, a column of times, or `rate`, samples per second".to_string();
                return Err(at(&["layout", &k], sentence));
            }
            if let Some(rate) = own.rate.filter(|rate| !(*rate > 0.0 && is_plausible(*rate))) {
                return Err(wrong("rate", format!("the rate {} must be a positive number", shown(rate))));
            }
            let clocks = own.columns.iter().filter_map(|(name, column)| Some((Some(name), column.time.as_ref()?)));
            for (column, clock) in clocks.chain(own.time.iter().map(|clock| (None, clock))) {
                if !own.times.contains_key(clock) {
                    let keys = match column {
                        Some(column) => ["layout", &k, "columns", column, "time"].to_vec(),
                        None => ["layout", &k, "time"].to_vec(),
                    };
                    let hint = did_you_mean(clock, own.times.keys().map(String::as_str));
                    let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
                    let sentence =
                        format!("the column of times `{clock}` is not in `times`, which says its unit{hint}");
                    return Err(at(&keys, sentence));
                }
            }
            for (name, scale) in &own.times {
                if !(*scale > 0.0 && is_plausible(*scale) && is_plausible(1.0 / scale)) {
                    let sentence = format!("`{name}`: {} is not a number of seconds per unit", shown(*scale));
                    return Err(at(&["layout", &k, "times", name], sentence));
                }
            }
            for (name, column) in &own.columns {
                let numbers = is_plausible(column.scale) && column.scale != 0.0 && is_plausible(column.offset);
                if !numbers {
                    let sentence = format!("`{name}`: the scale must be a number other than zero, the offset a number");
                    return Err(at(&["layout", &k, "columns", name], sentence));
                }
                if column.name.is_empty() && !column.skip {
                    let sentence = format!("`{name}` has no `name` and is not left out by `skip = true`");
                    return Err(at(&["layout", &k, "columns", name], sentence));
                }
            }
        }
        let files: Vec<&String> = self.layout.iter().flat_map(|layout| &layout.files).collect();
        for (k, shot) in self.shot.iter().enumerate() {
            let k = k.to_string();
            if files.iter().filter(|file| ***file == shot.file).count() != 1 {
                let sentence = format!("the file `{}` of a shot must stand in one `[[layout]]`", shot.file);
                return Err(at(&["shot", &k, "file"], sentence));
            }
            let layout = self.layout.iter().find(|layout| layout.files.contains(&shot.file));
            if shot.zero.is_some() && layout.is_some_and(|layout| layout.trigger.is_some()) {
                let sentence = format!("`{}` has both `zero` and a column of the trigger", shot.file);
                return Err(at(&["shot", &k, "zero"], sentence));
            }
            let times = [("zero", shot.zero), ("begin", shot.begin), ("end", shot.end)];
            if let Some((name, Some(value))) =
                times.into_iter().find(|(_, value)| value.is_some_and(|value| !is_plausible(value)))
            {
                return Err(at(&["shot", &k, name], format!("`{name}` is {}, which is not a time", shown(value))));
            }
            if let (Some(begin), Some(end)) = (shot.begin, shot.end)
                && begin >= end
            {
                let sentence = format!("the shot ends at {} s, and begins at {} s", shown(end), shown(begin));
                return Err(at(&["shot", &k, "end"], sentence));
            }
            if let Some((name, value)) = shot.conditions.iter().find(|(_, value)| !is_plausible(**value)) {
                let sentence = format!("the condition `{name}` is {}", shown(*value));
                return Err(at(&["shot", &k, "conditions", name], sentence));
            }
        }
        if self.shot.is_empty() {
            return Err(Fault::new("it names no `[[shot]]`"));
        }
        Ok(())
    }

    /// The layout of a file.
    pub(super) fn layout_of(&self, file: &str) -> Option<&Layout> {
        self.layout.iter().find(|layout| layout.files.iter().any(|own| own == file))
    }

    /// The text of an import file that says the same.
    pub fn text(&self) -> String {
        let mut text = String::from(
            "# How the files of a folder are read. Edit what is wrong and run `hyd bench import` on this file again.\n\n",
        );
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "name = {}\nfolder = {}    # relative to this file\n",
            quoted(&self.name),
            quoted(&self.folder)
        );
        for layout in &self.layout {
            layout.write(&mut text);
        }
        text.push_str(
            "\n# One for each file: its number, what was recorded beside the channels, and `zero = ...`, the time (s) that becomes 0 where\n\
             # no column of the trigger says it. `begin = ...` and `end = ...` (s, times of the file) cut a part out; a file may have several parts.\n",
        );
        for shot in &self.shot {
            let _ = write!(text, "\n[[shot]]\nfile = {}\nnumber = {}\n", quoted(&shot.file), shot.number);
            if let Some(zero) = shot.zero {
                let _ = writeln!(text, "zero = {zero:?}");
            }
            for (name, value) in [("begin", shot.begin), ("end", shot.end)] {
                if let Some(value) = value {
                    let _ = writeln!(text, "{name} = {value:?}");
                }
            }
            let conditions: Vec<String> =
                shot.conditions.iter().map(|(name, value)| format!("{} = {value:?}", key(name))).collect();
            let conditions = conditions.join(", ");
            let _ = writeln!(text, "conditions = {{ {conditions} }}");
        }
        text.push_str(
            "\n# What the lab knows of its bench, in the units above; what is not stated is estimated from the records.\n[set]\n\
             # base_model = \"default\"\n# noise_std = { p = 3e4 }\n# quantisation = { p = 1e4 }\n# sensor_offset_1sigma = { p = 4e4 }\n\
             # sensor_gain_1sigma = 0.002\n# parameter_tolerance_1sigma = { k = 0.1 }\n",
        );
        text
    }
}

impl Layout {
    fn write(&self, text: &mut String) {
        let files: Vec<String> = self.files.iter().map(|file| quoted(file)).collect();
        let _ = write!(text, "\n[[layout]]\nfiles = [{}]\n", files.join(", "));
        if !self.delimiter.is_empty() {
            let _ = write!(
                text,
                "encoding = {}\ndelimiter = {}\ndecimal = {}\nheader_line = {}    # 0: none\nunit_line = {}    # 0: none\nfirst_line = {}\n",
                quoted(&self.encoding),
                quoted(&self.delimiter),
                quoted(&self.decimal),
                self.header_line,
                self.unit_line,
                self.first_line
            );
        }
        if let Some(time) = &self.time {
            let _ = writeln!(text, "time = {}", quoted(time));
        }
        if !self.times.is_empty() {
            let times: Vec<String> =
                self.times.iter().map(|(name, scale)| format!("{} = {scale:?}", quoted(name))).collect();
            let _ = writeln!(text, "times = {{ {} }}    # seconds per unit", times.join(", "));
        }
        if let Some(rate) = self.rate {
            let _ = writeln!(text, "rate = {rate:?}    # samples per second");
        }
        match &self.trigger {
            Some(trigger) => {
                let _ = writeln!(text, "trigger = {}    # its first edge becomes time 0", quoted(trigger));
            }
            None => text.push_str("# trigger = \"...\"    # a column whose first edge becomes time 0\n"),
        }
        if self.drop_repeated {
            text.push_str("drop_repeated = true    # rows whose time is that of the row before are left out\n");
        }
        text.push_str("[layout.columns]    # written = scale * value of the file + offset\n");
        for (name, column) in &self.columns {
            if column.skip {
                let _ = writeln!(text, "{} = {{ skip = true }}", quoted(name));
                continue;
            }
            let _ = write!(
                text,
                "{} = {{ name = {}, unit = {}, from = {}, scale = {:?}",
                quoted(name),
                quoted(&column.name),
                quoted(&column.unit),
                quoted(&column.from),
                column.scale
            );
            if column.offset != 0.0 {
                let _ = write!(text, ", offset = {:?}", column.offset);
            }
            if let Some(time) = &column.time {
                let _ = write!(text, ", time = {}", quoted(time));
            }
            text.push_str(" }\n");
        }
    }
}

/// A string of TOML.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}

/// A key of TOML.
pub(super) fn key(text: &str) -> String {
    let bare = !text.is_empty() && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare { text.to_string() } else { quoted(text) }
}
