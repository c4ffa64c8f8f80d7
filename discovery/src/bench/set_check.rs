//! What a set states that makes no sense, or that nothing uses: keys that it does not have, names said twice, numbers that are not a
//! scatter, channels and tolerances that the study does not know and the other way round.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::marker::PhantomData;

use hyd_compiler::did_you_mean;
use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde_json::Value;

use crate::bench::Shot;
use crate::magnitude::{is_plausible, shown};
use crate::study::{Nuisance, Study};
use crate::{Bench, Fault};

/// Names that one message lists.
const MOST_NAMES: usize = 6;

/// An object none of whose names stands twice.
pub(crate) struct Once<T>(pub BTreeMap<String, T>);

impl<T> Default for Once<T> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Once<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Names<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Names<T> {
            type Value = Once<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Once<T>, M::Error> {
                let mut all = BTreeMap::new();
                while let Some((name, value)) = map.next_entry::<String, T>()? {
                    if all.contains_key(&name) {
                        return Err(M::Error::custom(format!("`{name}` stands twice")));
                    }
                    all.insert(name, value);
                }
                Ok(Once(all))
            }
        }
        deserializer.deserialize_map(Names(PhantomData))
    }
}

/// The line, from 1, of a key of the text that stands after the keys before it.
pub(crate) fn line_of(text: &str, keys: &[&str]) -> Option<usize> {
    let mut at = 0;
    for key in keys {
        let quoted = Value::from(*key).to_string();
        let is_key = |place: &usize| text[place + quoted.len()..].trim_start().starts_with(':');
        at += text[at..].match_indices(&quoted).map(|(place, _)| at + place).find(is_key)? - at;
    }
    Some(text[..at].matches('\n').count() + 1)
}

/// The line as the beginning of a sentence.
fn at_line(text: &str, keys: &[&str]) -> String {
    line_of(text, keys).map_or_else(String::new, |line| format!("line {line}: "))
}

fn or_nothing(hint: Option<String>) -> String {
    hint.map_or_else(String::new, |hint| format!("; {hint}"))
}

/// Sentences on keys that a set does not have; one that looks like a slip of the pen is a fault.
pub(crate) fn check_keys(text: &str) -> Result<Vec<String>, Fault> {
    let Ok(Value::Object(set)) = serde_json::from_str(text) else { return Ok(Vec::new()) };
    let mut warnings = Vec::new();
    for key in set.keys().filter(|key| !Bench::KEYS.contains(&key.as_str()) && !Bench::REMARKS.contains(&key.as_str()))
    {
        let line = at_line(text, &[key]);
        match did_you_mean(key, Bench::KEYS) {
            Some(hint) => return Err(Fault::new(format!("{line}a set has no `{key}`; {hint}"))),
            None => warnings.push(format!("{line}a set has no `{key}`, and nothing uses it")),
        }
    }
    Ok(warnings)
}

/// Refuses numbers that are not a scatter.
pub(crate) fn check_numbers(bench: &Bench, text: &str) -> Result<(), Fault> {
    let maps = [
        ("noise_std", &bench.noise),
        ("quantisation", &bench.quantisation),
        ("sensor_offset_1sigma", &bench.offset),
        ("parameter_tolerance_1sigma", &bench.tolerance),
    ];
    for (key, map) in maps {
        if let Some((name, value)) = map.iter().find(|(_, value)| !(is_plausible(**value) && **value >= 0.0)) {
            let line = at_line(text, &[key, name]);
            let wrong =
                if *value < 0.0 { "is not a positive number" } else { "is larger than anything that is measured" };
            let sentence = format!("{line}the standard deviation {} of `{name}` {wrong}", shown(*value));
            return Err(Fault::new(sentence));
        }
    }
    for (key, value) in [("sensor_gain_1sigma", bench.gain), ("pre_trigger_s", bench.pre_trigger)] {
        if let Some(value) = value.filter(|value| !(is_plausible(*value) && *value >= 0.0)) {
            let line = at_line(text, &[key]);
            let wrong = if value < 0.0 { "and must not be negative" } else { "larger than anything that is measured" };
            return Err(Fault::new(format!("{line}`{key}` is {}, {wrong}", shown(value))));
        }
    }
    Ok(())
}

/// Sentences on what the set states and the study does not use, and on what the study names and nothing states.  `columns`: those
/// of all tables.
pub(crate) fn unused(bench: &Bench, study: &Study, text: &str, columns: &BTreeSet<String>) -> Vec<String> {
    let mut warnings = Vec::new();
    let of_channels =
        [("noise_std", &bench.noise), ("quantisation", &bench.quantisation), ("sensor_offset_1sigma", &bench.offset)];
    for (key, map) in of_channels {
        // A lab may measure more than a study uses.
        for name in map.keys().filter(|name| !study.channels.contains_key(*name) && !columns.contains(*name)) {
            let hint = or_nothing(did_you_mean(name, study.channels.keys().map(String::as_str)));
            let line = at_line(text, &[key, name]);
            warnings.push(format!("{line}`{key}` is stated for `{name}`, which is not a channel of the study{hint}"));
        }
    }
    for name in study.channels.keys().filter(|name| bench.shots.iter().all(|s| !s.values.contains_key(*name))) {
        let unknown = columns.iter().filter(|column| !study.channels.contains_key(*column)).map(String::as_str);
        let what = if columns.contains(name) { "holds only gaps" } else { "stands in no table" };
        let hint = if columns.contains(name) { None } else { did_you_mean(name, unknown) };
        warnings.push(format!("channel `{name}` of the study {what} and is left out{}", or_nothing(hint)));
    }
    let is_stated = |name: &String| {
        bench.tolerance.contains_key(name)
            || matches!(study.nuisances.get(name), Some(Nuisance::Stated(own)) if own.relative.or(own.absolute).is_some())
    };
    let held: Vec<&str> = study.nuisances.keys().filter(|name| !is_stated(name)).map(String::as_str).collect();
    let useless = bench.tolerance.keys().filter(|name| !study.nuisances.contains_key(*name));
    for name in useless {
        let hint = or_nothing(did_you_mean(name, held.iter().copied()));
        let line = at_line(text, &["parameter_tolerance_1sigma", name]);
        warnings.push(format!("{line}a tolerance is stated for `{name}`, which is not a nuisance of the study{hint}"));
    }
    if !held.is_empty() {
        let shown: Vec<String> = held.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
        let more = held.len().saturating_sub(MOST_NAMES);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let them = if held.len() == 1 { "it is not fitted" } else { "they are not fitted" };
        let shown = shown.join(", ");
        warnings.push(format!("neither the set nor the study says how far {shown}{more} may be off: {them}"));
    }
    warnings
}

/// A sentence on shots of one number, which reports do not tell apart.
pub(crate) fn same_number(bench: &Bench) -> Option<String> {
    let mut first = BTreeMap::new();
    let again = |(k, shot): (usize, &Shot)| first.insert(shot.number, k).map(|other| (other + 1, k + 1, shot.number));
    let (one, other, number) = bench.shots.iter().enumerate().find_map(again)?;
    Some(format!(
        "the shots {one} and {other} of the list both have the number {number}: reports do not tell them apart"
    ))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use crate::{Bench, Fault, Study};

    const STUDY: &str = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny_mm = { variable = \"y\" }\n\
        [nuisances]\nk = \"k\"\n[shots]\ntime = \"t\"\n";

    fn table(change: impl Fn(&str) -> String) -> String {
        let mut text = String::from("t,y_mm\n");
        (0..25).for_each(|k| writeln!(text, "{k},{}", k * k).unwrap());
        change(&text)
    }

    fn read(set: &str, table: &str) -> Result<Vec<String>, String> {
        let study = Study::parse(STUDY).unwrap();
        let bench = Bench::parse(Path::new("set.json"), set, &study, &mut |_| Ok(table.to_string()));
        bench.map(|bench| bench.warnings).map_err(|fault| fault.sentence)
    }

    fn set(line: &str) -> String {
        format!("{{\n{line}\"experiments\": [{{\"file\": \"a.csv\"}}]}}")
    }

    const WHOLE: &str = "\"noise_std\": {\"y_mm\": 1}, \"parameter_tolerance_1sigma\": {\"k\": 0.1},\n";

    #[test]
    fn what_a_set_states_in_vain_is_said() {
        let plain = table(str::to_string);
        assert_eq!(read(&set(WHOLE), &plain), Ok(Vec::new()));
        for (line, expected) in [
            (
                "\"noise_std\": {\"y\": 1}, \"parameter_tolerance_1sigma\": {\"k\": 0.1},",
                "`set.json`: line 2: `noise_std` is stated for `y`, which is not a channel of the study",
            ),
            (
                "\"parameter_tolerance_1sigma\": {\"K\": 0.1},",
                "`set.json`: line 2: a tolerance is stated for `K`, which is not a nuisance of the study; did you mean `k`?",
            ),
            ("", "`set.json`: neither the set nor the study says how far `k` may be off: it is not fitted"),
            (
                "\"parameter_tolerance_1sigma\": {\"k\": 0.1},\n\"weather\": 1,",
                "`set.json`: line 3: a set has no `weather`, and nothing uses it",
            ),
        ] {
            let said = read(&set(line), &plain).unwrap();
            assert_eq!(said[0], expected, "{said:?}");
        }
    }

    #[test]
    fn what_a_set_cannot_mean_is_refused_with_its_line() {
        let plain = table(str::to_string);
        for (set, expected) in [
            (set("\n\"noise_sdt\": {},"), "`set.json`: line 3: a set has no `noise_sdt`; did you mean `noise_std`?"),
            (set("\"quantisation\": {\"y_mm\": -1},"), "`set.json`: line 2: the standard deviation -1 of `y_mm`"),
            (set("\"sensor_gain_1sigma\": -1,"), "`set.json`: line 2: `sensor_gain_1sigma` is -1"),
            (set("\"noise_std\": {\"y_mm\": 1, \"y_mm\": 2},"), "`set.json`: `y_mm` stands twice at line 2"),
            (
                set("\"noise_std\": {\"y_mm\": 1e300},"),
                "`set.json`: line 2: the standard deviation 1e300 of `y_mm` is larger",
            ),
            (set("\"sensor_gain_1sigma\": 1e300,"), "`set.json`: line 2: `sensor_gain_1sigma` is 1e300, larger than"),
            (" ".repeat((4 << 20) + 1), "`set.json`: it is longer than 4 MB, as no set is"),
            (set("\"noise_std\": {\"y_mm\": 1e999},"), "`set.json`: number out of range at line 2"),
            ("{\"experiments\": []}".to_string(), "`set.json`: line 1: it holds no shots"),
            (
                "{\n\"experimnts\": []}".to_string(),
                "`set.json`: line 2: a set has no `experimnts`; did you mean `experiments`?",
            ),
            (
                "{\"experiments\": [{\"fiel\": \"a.csv\"}]}".to_string(),
                "`set.json`: shot 1 in its list names no file; `fiel`: did you mean `file`?",
            ),
            (
                "{\"experiments\": [{\"file\": \"a.csv\", \"p\": \"1e5\"}]}".to_string(),
                "`set.json`: shot 1 in its list: `p` is the text \"1e5\"",
            ),
            (
                "{\"experiments\": [{\"file\": \"a.csv\", \"shot\": 1.5}]}".to_string(),
                "`set.json`: shot 1 in its list: `shot` is 1.5",
            ),
        ] {
            let said = read(&set, &plain).unwrap_err();
            assert!(said.starts_with(expected), "{set}\n{said}");
        }
    }

    #[test]
    fn what_stands_under_another_name_is_proposed() {
        let study = format!(
            "{}rate = 1\n",
            STUDY.replace("[shots]\ntime = \"t\"\n", "[inputs]\nu = { column = \"volts\" }\n[shots]\n")
        );
        for (study, header, expected) in [
            (
                study.as_str(),
                "volt,y_mm\n",
                "there is no column `volts` for the input `u` (line 9 of the study); did you mean `volt`?",
            ),
            (STUDY, "tt,y_mm\n", "there is no column `t` of times; there are: tt, y_mm; did you mean `tt`?"),
        ] {
            let study = Study::parse(study).unwrap();
            let table = table(|text| text.replacen("t,y_mm\n", header, 1));
            let said = Bench::parse(Path::new("set.json"), &set(WHOLE), &study, &mut |_| Ok(table.clone()));
            let said = said.unwrap_err().sentence;
            assert!(said.ends_with(expected), "{said}");
        }
        // A table that is not there is known by the set's line.
        let set = "{\"experiments\": [{\"file\": \"a.csv\"},\n{\"file\": \"b.csv\"}]}";
        let plain = table(str::to_string);
        let mut read = |name: &str| match name {
            "a.csv" => Ok(plain.clone()),
            _ => Err(Fault::new(format!("`{name}` cannot be read"))),
        };
        let study = Study::parse(STUDY).unwrap();
        let said = Bench::parse(Path::new("set.json"), set, &study, &mut read).unwrap_err().sentence;
        assert_eq!(said, "`b.csv` cannot be read (shot 2 of `set.json`, line 2)");
    }

    #[test]
    fn tables_are_refused_with_their_line() {
        let faults: [(&str, &str, &str); 9] = [
            ("3,9\n", "3,1e300\n", "`a.csv`: line 5, column `y_mm`: 1e300 is not a measured value"),
            ("3,9\n", "3,inf\n", "`a.csv`: line 5, column `y_mm`: `inf` is not a measured value"),
            ("3,9\n", "3,1e999\n", "`a.csv`: line 5, column `y_mm`: `1e999` is not a measured value"),
            ("3,9\n", "3,0,9\n", "`a.csv`: line 5 has 3 fields, and the header 2; numbers have a decimal point"),
            ("3,9\n", "3\n", "`a.csv`: line 5 has 1 field, and the header 2"),
            ("3,9\n", "\n\n3,x\n", "`a.csv`: line 7, column `y_mm`: `x` is not a number"),
            ("3,9\n", "1,9\n", "`a.csv`: line 5: the time 1 s does not come after 2 s"),
            ("t,y_mm\n", "t,y_mm,y_mm\n", "`a.csv`: the column `y_mm` stands twice in the header"),
            ("t,y_mm\n", "t;y_mm\n", "`a.csv`: its fields are separated by semicolons; tables of shots have commas"),
        ];
        for (from, to, expected) in faults {
            let said = read(&set(WHOLE), &table(|text| text.replacen(from, to, 1))).unwrap_err();
            assert!(said.starts_with(expected), "{to:?}\n{said}");
        }
        // Gaps are none.
        let gaps = table(|text| text.replacen("3,9\n", "3,\n", 1).replacen("4,16\n", "4,NaN\n", 1));
        assert_eq!(read(&set(WHOLE), &gaps), Ok(Vec::new()));
    }
}
