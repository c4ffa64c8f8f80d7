//! Rows of an evaluation as they are judged: what was hidden, what came out, and whether that is right.

use crate::draft::{Points, Request};
use crate::effects::Effect;
use serde_json::Value;
use std::path::Path;

/// One trial.
#[derive(Clone, Debug)]
pub struct Row(Value);

/// How a trial with one effect of the catalogue ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// The effect was named, and nothing else.
    Right,
    /// Several were left to choose from, at most three, the effect among them.
    Among,
    /// Something else was named, or more than there is.
    Wrong,
    /// Nothing is missing, it was said.
    Adequate,
    /// Something is missing that no effect explains, it was said; or a choice without the effect.
    Unknown,
    /// The fits did not end, or there was no report in time.
    None,
}

impl Row {
    /// Reads files of rows; of a trial that stands there twice the first row counts.  What [`crate::matching`] answered
    /// stands in lines of its own and joins the row of its trial.
    pub fn read(paths: &[&Path]) -> Result<Vec<Row>, String> {
        let mut rows: Vec<Row> = Vec::new();
        let mut known = std::collections::BTreeSet::new();
        let mut answers = std::collections::BTreeMap::new();
        for path in paths {
            let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
            for (number, line) in text.lines().enumerate() {
                let value: Value = serde_json::from_str(line)
                    .map_err(|error| format!("{}, line {}: {error}", path.display(), number + 1))?;
                let key = (value["trial"].to_string(), value["seed"].to_string());
                if value.get("kind").is_none() {
                    answers.insert(key, value["by_derivatives"].clone());
                } else if known.insert(key) {
                    rows.push(Row(value));
                }
            }
        }
        for row in &mut rows {
            let key = (row.0["trial"].to_string(), row.0["seed"].to_string());
            row.0["by_derivatives"] = answers.remove(&key).unwrap_or(Value::Null);
        }
        Ok(rows)
    }

    /// The trial again.
    pub fn request(&self) -> Option<Request> {
        let effect = |truth: &Value| Some((truth["name"].as_str()?.to_string(), truth["size"].as_f64()?));
        let effects = self.0["truth"].as_array()?.iter().map(effect).collect::<Option<_>>()?;
        let disturbances = self.0["disturbances"].as_array().into_iter().flatten();
        let disturbances = disturbances.filter_map(|own| own.as_str().map(String::from)).collect();
        Some(Request {
            name: self.text("trial").to_string(),
            seed: self.0["seed"].as_u64()?,
            effects,
            disturbances,
            points: Points::default(),
        })
    }

    /// What matched derivatives answered: nothing as long as nobody asked, an empty name where they named nothing.
    pub fn by_derivatives(&self) -> Option<&str> {
        self.0["by_derivatives"].as_str()
    }

    /// `null`, `effect`, `outside`, `pair` or `triple`.
    pub fn kind(&self) -> &str {
        self.0["kind"].as_str().unwrap_or("")
    }

    /// Text under a key.
    pub fn text(&self, key: &str) -> &str {
        self.0[key].as_str().unwrap_or("")
    }

    /// Number under a key.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.0[key].as_f64()
    }

    /// True if every one of several effects has a larger expected drop of the cost beside the others than this.
    pub fn is_each_above(&self, least: f64) -> bool {
        let each = self.0["power_of_each"].as_array();
        each.is_some_and(|each| each.iter().all(|power| power.as_f64().is_some_and(|power| power > least)))
    }

    /// Names of what is hidden.
    pub fn hidden(&self) -> Vec<&str> {
        self.0["truth"].as_array().into_iter().flatten().filter_map(|truth| truth["name"].as_str()).collect()
    }

    /// True if what is hidden is a measuring chain's.
    pub fn is_sensor(&self) -> bool {
        self.0["truth"][0]["kind"] == "sensor"
    }

    /// Names that came out; none but with the statuses that give names.
    pub fn named(&self) -> Vec<&str> {
        let gives = ["named", "sensor", "law"].contains(&self.text("status"));
        self.0["named"].as_array().into_iter().flatten().filter(|_| gives).filter_map(Value::as_str).collect()
    }

    /// Kinds of what was named: `physics` or `sensor`.
    pub fn kinds(&self) -> Vec<&str> {
        self.0["kinds"].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
    }

    /// Effects that were left to choose from.
    pub fn ambiguous(&self) -> Vec<&str> {
        self.0["ambiguous"].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
    }

    /// All that is hidden was named, and nothing else.
    pub fn all_named(&self) -> bool {
        let (mut hidden, mut named) = (self.hidden(), self.named());
        hidden.sort_unstable();
        named.sort_unstable();
        hidden == named
    }

    /// How it ended.
    pub fn end(&self) -> End {
        let hidden = self.hidden();
        let ambiguous = self.ambiguous();
        match self.text("status") {
            "named" | "sensor" if self.all_named() => End::Right,
            "named" | "sensor" => End::Wrong,
            // Of what a catalogue holds.
            "law" if self.text("kind") != "outside" => End::Wrong,
            "ambiguous" if ambiguous.len() <= 3 && hidden.iter().any(|id| ambiguous.contains(id)) => End::Among,
            "law" if !self.named().is_empty() => End::Wrong,
            "ambiguous" | "unknown" | "law" => End::Unknown,
            "adequate" => End::Adequate,
            _ => End::None,
        }
    }

    /// The rank (from 1) of the first equation or place where the hidden effect may be said to be, by the list that was
    /// drawn with it.
    pub fn place(&self) -> Option<usize> {
        self.rank(self.0["truth"][0]["places"].as_array().into_iter().flatten().filter_map(Value::as_str).collect())
    }

    /// The same by the list that the effect has now.
    pub fn place_by_present_lists(&self) -> Option<usize> {
        match self.hidden()[..] {
            [id] => Effect::find(id).and_then(|effect| self.rank(effect.places.to_vec())),
            _ => self.place(),
        }
    }

    fn rank(&self, places: Vec<&str>) -> Option<usize> {
        let is_there = |site: &Value| {
            let component = site["component"].as_str().unwrap_or("");
            places.iter().any(|place| component.split('.').any(|part| part == *place))
        };
        Some(self.0["location"].as_array()?.iter().position(is_there)? + 1)
    }

    /// The gap of the shots held out, before and after.
    pub fn held_out(&self) -> Option<(f64, f64)> {
        let gap = &self.0["gap"]["heldout"];
        Some((gap["before"].as_f64()?, gap["after"].as_f64()?))
    }

    /// Whether the 95 % interval of the size holds the size hidden, where both are stated the same way; without an interval in the row 1.96
    /// standard errors are one.
    pub fn is_size_inside(&self) -> Option<bool> {
        let hidden = &self.0["truth"][0]["parameters"];
        let own = |name: &str| hidden[name].as_f64();
        let (name, value) = match self.hidden()[..] {
            ["supply_line"] => ("l", own("L")?),
            ["incomplete_filling"] => ("void", 1.0 - own("wyp")?),
            ["eddy_currents"] => ("g_e", 1.0 / own("R_e")?),
            ["stop_elasticity"] => ("c_2", 1.0 / own("k_2")?),
            ["sensor_offset"] => ("b", own("offset")?),
            ["trigger_delay"] => ("t_d", own("delay")?),
            [_] => {
                let name = self.0["truth"][0]["size_name"].as_str().filter(|name| !name.is_empty())?;
                (name, own(name)?)
            }
            _ => return None,
        };
        let found = &self.0["parameters"][0][name];
        let (estimate, error) = (found["value"].as_f64()?, found["stderr"].as_f64()?);
        let ends = [0, 1].map(|k| found["interval"][k].as_f64());
        let inside = match ends {
            [Some(low), Some(high)] => (low..=high).contains(&value),
            _ => (estimate - value).abs() <= 1.96 * error,
        };
        (error > 0.0).then_some(inside)
    }

    /// Fitted parameters that are within 1.96 standard errors of what was drawn, and how many there are.
    pub fn parameters_inside(&self) -> (usize, usize) {
        let pulls = self.0["fitted"].as_object().into_iter().flatten().filter_map(|(_, pull)| pull.as_f64());
        pulls.fold((0, 0), |(inside, all), pull| (inside + usize::from(pull.abs() <= 1.96), all + 1))
    }

    /// The best entry of `promised` or `alone`: effect without its channel, and number.
    pub fn best(&self, key: &str) -> Option<(&str, f64)> {
        let first = &self.0[key][0];
        Some((first[0].as_str()?.split(' ').next()?, first[1].as_f64()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn row(status: &str, named: &[&str], ambiguous: &[&str]) -> Row {
        Row(json!({"kind": "effect", "status": status, "named": named, "ambiguous": ambiguous,
            "truth": [{"name": "eddy_currents", "places": ["lc"], "parameters": {"R_e": 20.0}, "size_name": "R_e"}],
            "location": [{"component": "ro.em"}, {"component": "ro.lc"}],
            "parameters": [{"g_e": {"value": 0.053, "stderr": 0.002}}]}))
    }

    #[test]
    fn ends_are_judged() {
        assert_eq!(row("named", &["eddy_currents"], &[]).end(), End::Right);
        assert_eq!(row("named", &["eddy_currents", "sensor_lag"], &[]).end(), End::Wrong);
        assert_eq!(row("ambiguous", &[], &["eddy_currents", "sensor_lag"]).end(), End::Among);
        assert_eq!(row("ambiguous", &[], &["sensor_lag", "coil_heating"]).end(), End::Unknown);
        assert_eq!(row("unknown", &[], &[]).end(), End::Unknown);
        assert_eq!(row("none", &[], &[]).end(), End::None);
        let right = row("named", &["eddy_currents"], &[]);
        assert_eq!((right.place(), right.place_by_present_lists()), (Some(2), Some(1)));
        // 0.053 +- 0.002 for 0.05; the interval may be wider than that of the noise.
        assert_eq!(right.is_size_inside(), Some(true));
        let size = |own: Value| {
            let mut row = row("named", &["eddy_currents"], &[]);
            row.0["parameters"][0]["g_e"] = own;
            row.is_size_inside()
        };
        assert_eq!(size(json!({"value": 0.054, "stderr": 0.002})), Some(false));
        assert_eq!(size(json!({"value": 0.054, "stderr": 0.002, "interval": [0.0475, 0.0605]})), Some(true));
    }

    #[test]
    fn several_effects_can_be_seen_where_each_can() {
        let of = |each: Value| Row(json!({"kind": "pair", "power_of_each": each})).is_each_above(400.0);
        assert!(of(json!([500.0, 1e6])) && !of(json!([98.0, 1e6])));
        // Rows of earlier programs do not say.
        assert!(!of(Value::Null));
    }
}
