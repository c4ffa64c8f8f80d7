//! What a study says that makes no sense, reported with its line: numbers that are not a scatter or a time, names of channels and
//! conditions that it does not have, things said twice.

use hyd_compiler::did_you_mean;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::Fault;
use crate::elements::sizes;
use crate::magnitude::{is_plausible, shown};
use crate::study::initial::{Initial, StartOf};
use crate::study::{Mask, Nuisance, Shots, Study};

/// Most rows that are averaged to one.
const MOST_AVERAGED: usize = 10_000;
/// Most windows of a table.
const MOST_WINDOWS: usize = 10_000;

/// Checks a study that has been read from `text`.
pub(crate) fn check(study: &Study, text: &str) -> Result<(), Fault> {
    let check = Check { study, text, table: DeTable::parse(text).ok() };
    check.models()?;
    check.channels()?;
    check.inputs()?;
    check.initial()?;
    check.nuisances()?;
    check.shots()?;
    check.limits()?;
    check.run()
}

/// What the reader of TOML says, with the line, and with the key that was perhaps meant.
pub(crate) fn unreadable(text: &str, error: &toml::de::Error) -> Fault {
    let message = error.message();
    let line = error.span().map_or_else(String::new, |span| format!("line {}: ", line_at(text, span.start)));
    let mut quoted = message.split('`').skip(1).step_by(2);
    let hint = match (message.starts_with("unknown field"), quoted.next()) {
        (true, Some(wrong)) => did_you_mean(wrong, quoted),
        _ => None,
    };
    Fault::new(format!("{line}{message}{}", hint.map_or_else(String::new, |hint| format!("; {hint}"))))
}

/// The line of the value that these keys lead to; positions of lists are keys, too.
pub(crate) fn line(text: &str, keys: &[&str]) -> Option<usize> {
    let table = DeTable::parse(text).ok()?;
    offset(&table, keys).map(|offset| line_at(text, offset))
}

/// True for names with dots between them; what stands in quotes is anything.
fn is_class_name(text: &str) -> bool {
    let (mut quoted, mut letters) = (false, text.chars());
    while let Some(letter) = letters.next() {
        match letter {
            '\'' => quoted = !quoted,
            '\\' if quoted => drop(letters.next()),
            _ if quoted || letter.is_alphanumeric() || "_.".contains(letter) => {}
            _ => return false,
        }
    }
    !quoted && !text.is_empty()
}

fn offset(table: &Spanned<DeTable<'_>>, keys: &[&str]) -> Option<usize> {
    let (first, rest) = keys.split_first()?;
    let mut value = table.get_ref().get(*first)?;
    for key in rest {
        value = match value.get_ref() {
            DeValue::Table(table) => table.get(*key)?,
            DeValue::Array(list) => list.get(key.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(value.span().start)
}

fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|&byte| byte == b'\n').count() + 1
}

struct Check<'a> {
    study: &'a Study,
    text: &'a str,
    /// The text with the places of its values.
    table: Option<Spanned<DeTable<'a>>>,
}

impl Check<'_> {
    /// A fault at a value, which is found by its keys; positions of lists are keys, too.
    fn wrong(&self, keys: &[&str], sentence: impl Into<String>) -> Fault {
        let sentence = sentence.into();
        match self.table.as_ref().and_then(|table| offset(table, keys)) {
            Some(offset) => Fault::new(format!("line {}: {sentence}", line_at(self.text, offset))),
            None => Fault::new(sentence),
        }
    }

    /// A number that must be positive, or at least not negative.
    fn scatter(&self, keys: &[&str], what: &str, value: Option<f64>, may_be_zero: bool) -> Result<(), Fault> {
        match value {
            Some(value) if !(value.is_finite() && (value > 0.0 || may_be_zero && value == 0.0)) => {
                let wanted = if may_be_zero { "a number that is not negative" } else { "a positive number" };
                Err(self.wrong(keys, format!("{what} is {}, and must be {wanted}", shown(value))))
            }
            Some(value) => self.size(keys, what, value),
            None => Ok(()),
        }
    }

    /// A number of a size that makes sense.
    fn size(&self, keys: &[&str], what: &str, value: f64) -> Result<(), Fault> {
        if is_plausible(value) {
            return Ok(());
        }
        Err(self.wrong(keys, format!("{what} is {}, larger than anything that is measured", shown(value))))
    }

    /// A name among those that there are.
    fn known<'n>(
        &self,
        keys: &[&str],
        what: &str,
        name: &str,
        names: impl Iterator<Item = &'n String> + Clone,
    ) -> Result<(), Fault> {
        if names.clone().any(|known| known == name) {
            return Ok(());
        }
        let hint = did_you_mean(name, names.map(String::as_str)).map_or_else(String::new, |hint| format!("; {hint}"));
        Err(self.wrong(keys, format!("{what} `{name}`, which the study does not have{hint}")))
    }

    fn models(&self) -> Result<(), Fault> {
        match self.study.models.iter().find(|(_, class)| !is_class_name(class)) {
            Some((key, class)) => Err(self.wrong(&["models", key], format!("`{class}` is not the name of a class"))),
            None => Ok(()),
        }
    }

    /// True for a column of times of a channel or an input.
    fn is_clock(&self, name: &str) -> bool {
        let channels = self.study.channels.values().filter_map(|own| own.time.as_deref());
        channels.chain(self.study.inputs.values().filter_map(|own| own.time.as_deref())).any(|own| own == name)
    }

    fn channels(&self) -> Result<(), Fault> {
        if self.study.channels.is_empty() {
            return Err(Fault::new("the study names no channel"));
        }
        for (name, own) in &self.study.channels {
            let key = |key| ["channels", name, key];
            if *name == self.study.shots.time && self.study.shots.rate.is_none() || self.is_clock(name) {
                return Err(self.wrong(&["channels", name], format!("channel `{name}` is the column of times")));
            }
            if !(own.scale.is_finite() && own.scale != 0.0) {
                let sentence = format!("channel `{name}`: the scale {} must be a number but zero", own.scale);
                return Err(self.wrong(&key("scale"), sentence));
            }
            if !(is_plausible(own.scale) && is_plausible(1.0 / own.scale)) {
                let sentence = format!("channel `{name}`: the scale {} is not a ratio of units", shown(own.scale));
                return Err(self.wrong(&key("scale"), sentence));
            }
            if own.variable.trim().is_empty() {
                return Err(self.wrong(&key("variable"), format!("channel `{name}` names no variable of the model")));
            }
            let numbers =
                [("noise", own.noise), ("quantisation", own.quantisation), ("offset", own.offset), ("gain", own.gain)];
            for (word, value) in numbers {
                self.scatter(&key(word), &format!("channel `{name}`: `{word}`"), value, true)?;
            }
            if let Some((low, high)) = own.range
                && (low.is_nan() || high.is_nan() || low >= high)
            {
                let sentence = format!("channel `{name}`: `range` from {low} to {high} is empty");
                return Err(self.wrong(&key("range"), sentence));
            }
        }
        Ok(())
    }

    /// What the bench can do.
    fn limits(&self) -> Result<(), Fault> {
        let limits = &self.study.limits;
        let ends = |keys: &[&str], (min, max): (Option<f64>, Option<f64>)| {
            let is_number = |end: &Option<f64>| end.is_none_or(is_plausible);
            match (min, max) {
                (Some(min), Some(max)) if min >= max => {
                    Err(self.wrong(keys, format!("from {} to {} there is nothing", shown(min), shown(max))))
                }
                _ if is_number(&min) && is_number(&max) => Ok(()),
                _ => Err(self.wrong(keys, "a limit must be a number")),
            }
        };
        for (name, own) in &limits.settings {
            ends(&["limits", "settings", name], (own.min, own.max))?;
            let key = ["limits", "settings", name, "step"];
            self.scatter(&key, &format!("the step of `{name}`"), own.step, false)?;
        }
        for (name, own) in &limits.channels {
            let key = ["limits", "channels", name];
            self.known(&key, "`[limits.channels]` names", name, self.study.channels.keys())?;
            ends(&key, (own.min, own.max))?;
        }
        for (k, region) in limits.forbidden.iter().enumerate() {
            let place = k.to_string();
            if region.is_empty() {
                return Err(
                    self.wrong(&["limits", "forbidden", &place], "a region without any side forbids everything")
                );
            }
            for (name, side) in region {
                let keys = ["limits", "forbidden", &place, name];
                if side.above.is_none() && side.below.is_none() {
                    return Err(self.wrong(&keys, format!("`{name}` needs `above` or `below`")));
                }
                ends(&keys, (side.above, side.below))?;
            }
        }
        Ok(())
    }

    fn inputs(&self) -> Result<(), Fault> {
        for (name, own) in &self.study.inputs {
            let key = |key| ["inputs", name, key];
            if own.column == self.study.shots.time && self.study.shots.rate.is_none() || self.is_clock(&own.column) {
                let sentence = format!("the input `{name}` follows `{}`, the column of times", own.column);
                return Err(self.wrong(&key("column"), sentence));
            }
            if !(own.scale.is_finite() && own.scale != 0.0) {
                let sentence = format!("input `{name}`: the scale {} must be a number but zero", own.scale);
                return Err(self.wrong(&key("scale"), sentence));
            }
            if !(is_plausible(own.scale) && is_plausible(1.0 / own.scale)) {
                let sentence = format!("input `{name}`: the scale {} is not a ratio of units", shown(own.scale));
                return Err(self.wrong(&key("scale"), sentence));
            }
            for (word, value) in [("offset", own.offset), ("lag", own.lag)] {
                if !value.is_finite() {
                    return Err(self.wrong(&key(word), format!("input `{name}`: `{word}` must be a number")));
                }
                self.size(&key(word), &format!("input `{name}`: `{word}`"), value)?;
            }
        }
        Ok(())
    }

    fn initial(&self) -> Result<(), Fault> {
        for (state, own) in &self.study.initial {
            let key = |key| ["initial", state, key];
            let array = StartOf::array(state).filter(|(name, _)| is_class_name(name));
            let Some((name, subscripts)) = array else {
                return Err(self.wrong(&["initial", state], format!("`{state}` is not the name of a variable")));
            };
            if !subscripts.is_empty() {
                self.all_elements(state, &name)?;
            }
            let Initial::Stated(own) = own else { continue };
            if own.value.is_some() == own.at_rest {
                let sentence = format!("`{state}` begins at a `value` or `at_rest = true`, one of them");
                return Err(self.wrong(&["initial", state], sentence));
            }
            if own.at_rest && own.absolute.is_some() {
                let sentence = format!("`{state}` is at rest, so that `absolute` has no use");
                return Err(self.wrong(&key("absolute"), sentence));
            }
            self.scatter(&key("absolute"), &format!("initial state `{state}`: `absolute`"), own.absolute, false)?;
        }
        Ok(())
    }

    /// The array of a state is set in all of its elements alike: a text that sets the beginning of one sets that of all.
    fn all_elements(&self, state: &str, array: &str) -> Result<(), Fault> {
        let own = self.study.initial.iter().filter_map(|(state, own)| {
            let (name, subscripts) = StartOf::array(state)?;
            (name == array && !subscripts.is_empty()).then_some((subscripts, own.formula().is_none()))
        });
        let own: Vec<(Vec<usize>, bool)> = own.collect();
        let count: usize = sizes(own.iter().map(|(subscripts, _)| subscripts.as_slice())).iter().product();
        let sentence = if own.len() < count {
            format!(
                "`{state}` is an element of the array `{array}`, of which all elements must begin somewhere: {} of {count} do",
                own.len()
            )
        } else if own.iter().any(|(_, at_rest)| *at_rest != own[0].1) {
            format!("of the array `{array}` all elements are at rest at the beginning, or none is")
        } else {
            return Ok(());
        };
        Err(self.wrong(&["initial", state], sentence))
    }

    fn nuisances(&self) -> Result<(), Fault> {
        let mut named: Vec<(&str, &str)> = Vec::new();
        for (name, nuisance) in &self.study.nuisances {
            if let Some((other, _)) = named.iter().find(|(_, parameter)| *parameter == nuisance.parameter()) {
                let parameter = nuisance.parameter();
                let sentence = format!("`{other}` and `{name}` in `[nuisances]` are both the parameter `{parameter}`");
                return Err(self.wrong(&["nuisances", name], sentence));
            }
            named.push((name, nuisance.parameter()));
            if name.trim().is_empty() {
                return Err(self.wrong(&["nuisances", name], "a nuisance has no name"));
            }
            let Nuisance::Stated(own) = nuisance else { continue };
            let key = |key| ["nuisances", name, key];
            if own.relative.is_some() && own.absolute.is_some() {
                let sentence = format!("nuisance `{name}` says both `relative` and `absolute`; it has one scatter");
                return Err(self.wrong(&key("absolute"), sentence));
            }
            for (word, value) in [("relative", own.relative), ("absolute", own.absolute)] {
                self.scatter(&key(word), &format!("nuisance `{name}`: `{word}`"), value, false)?;
            }
        }
        Ok(())
    }

    fn shots(&self) -> Result<(), Fault> {
        let shots = &self.study.shots;
        let key = |key| ["shots", key];
        self.scatter(&key("rate"), "`rate`", shots.rate, false)?;
        if shots.rate.is_some() && (shots.time != Shots::default().time || shots.time_scale != 1.0) {
            let sentence =
                "`rate` is for tables without a column of times; `time` and `time_scale` have no use beside it";
            return Err(self.wrong(&key("rate"), sentence));
        }
        self.scatter(&key("time_scale"), "`time_scale`", Some(shots.time_scale), false)?;
        if !is_plausible(1.0 / shots.time_scale) {
            let sentence = format!("`time_scale` is {}, and no unit of time is so short", shown(shots.time_scale));
            return Err(self.wrong(&key("time_scale"), sentence));
        }
        self.scatter(&key("trigger_jitter"), "`trigger_jitter`", Some(shots.trigger_jitter), true)?;
        self.scatter(&key("time_tolerance"), "`time_tolerance`", Some(shots.time_tolerance), true)?;
        for (k, name) in shots.trigger_moves.iter().enumerate() {
            let keys = ["shots", "trigger_moves", &k.to_string()];
            self.known(&keys, "`trigger_moves` names the condition", name, self.study.conditions.keys())?;
            if shots.trigger_moves[..k].contains(name) {
                return Err(self.wrong(&keys, format!("`trigger_moves` names `{name}` twice")));
            }
        }
        if let Some(count) = shots.average
            && !(1..=MOST_AVERAGED).contains(&count)
        {
            return Err(self.wrong(&key("average"), format!("`average` is {count}, and must be 1 to {MOST_AVERAGED}")));
        }
        if let Some(count) = shots.windows {
            if !(1..=MOST_WINDOWS).contains(&count) {
                return Err(
                    self.wrong(&key("windows"), format!("`windows` is {count}, and must be 1 to {MOST_WINDOWS}"))
                );
            }
            if count > 1 && self.study.run.start.is_some() {
                let sentence = "a window begins with its first sample, so that `start` of runs has no use";
                return Err(self.wrong(&["run", "start"], sentence));
            }
        }
        if let Some(name) = &shots.phases_of {
            self.known(&key("phases_of"), "`phases_of` names the channel", name, self.study.channels.keys())?;
        }
        let held_out = shots.hold_out.iter().flatten().enumerate();
        for (k, number) in held_out {
            if shots.hold_out.iter().flatten().take(k).any(|other| other == number) {
                let keys = ["shots", "hold_out", &k.to_string()];
                return Err(self.wrong(&keys, format!("`hold_out` names shot {number} twice")));
            }
        }
        shots.masks.iter().enumerate().try_for_each(|(k, mask)| self.mask(mask, &k.to_string()))
    }

    fn mask(&self, mask: &Mask, number: &str) -> Result<(), Fault> {
        let here = ["shots", "masks", number];
        let key = |key| ["shots", "masks", number, key];
        for name in &mask.channels {
            self.known(&key("channels"), "a mask names the channel", name, self.study.channels.keys())?;
        }
        if let Some(name) = &mask.after_return_of {
            self.known(&key("after_return_of"), "a mask names the channel", name, self.study.channels.keys())?;
        }
        for (word, value) in [("from", mask.from), ("to", mask.to)] {
            if value.is_some_and(f64::is_nan) {
                return Err(self.wrong(&key(word), format!("`{word}` of a mask must be a time (s)")));
            }
        }
        if let (Some(from), Some(to)) = (mask.from, mask.to)
            && from > to
        {
            return Err(self.wrong(&key("from"), format!("a mask from {from} s to {to} s holds no time")));
        }
        let is_positive = mask.within.is_some_and(|within| within > 0.0 && within.is_finite());
        if mask.around.is_empty() == mask.within.is_some() || mask.within.is_some() && !is_positive {
            let sentence = "a mask with `around` needs `within`, a positive time to both sides (s), and one without has no use for it";
            let within = key("within");
            let place: &[&str] = if mask.within.is_some() { &within } else { &here };
            return Err(self.wrong(place, sentence));
        }
        if let Some(below) = mask.below {
            if mask.after_return_of.is_none() {
                return Err(self.wrong(&key("below"), "`below` of a mask has no use without `after_return_of`"));
            }
            if !(below > 0.0 && below < 1.0) {
                let sentence = format!("`below` of a mask is {below}, and must be a share between 0 and 1");
                return Err(self.wrong(&key("below"), sentence));
            }
        }
        if mask.around.is_empty() && mask.from.is_none() && mask.to.is_none() && mask.after_return_of.is_none() {
            let sentence = "a mask says which part is left out: `from`, `to`, `around` or `after_return_of`";
            return Err(self.wrong(&here, sentence));
        }
        Ok(())
    }

    fn run(&self) -> Result<(), Fault> {
        let run = &self.study.run;
        if run.start.is_some_and(|start| !start.is_finite()) {
            return Err(self.wrong(&["run", "start"], "the start of runs must be a time (s)"));
        }
        if !(1e-12..=1e-3).contains(&run.tolerance) {
            let sentence = format!("the tolerance {} must lie between 1e-12 and 1e-3", run.tolerance);
            return Err(self.wrong(&["run", "tolerance"], sentence));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::Study;

    /// What is said of a study with these lines in it, the first of which is line 6.
    fn said(lines: &str) -> String {
        let text =
            format!("file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = {{ variable = \"x\" }}\n{lines}\n");
        Study::parse(&text).map_or_else(|fault| fault.sentence, |_| String::new())
    }

    #[test]
    fn what_makes_no_sense_is_told_with_its_line() {
        for (lines, expected) in [
            ("[nuisances]\nk = { parameter = \"k\", relative = -0.3 }", "line 7: nuisance `k`: `relative` is -0.3"),
            ("[nuisances]\nk = { parameter = \"k\", relative = 0.0 }", "line 7: nuisance `k`: `relative` is 0"),
            ("[nuisances]\nk = { parameter = \"k\", relative = nan }", "line 7: nuisance `k`: `relative` is NaN"),
            ("[nuisances]\nk = { parameter = \"k\", absolute = inf }", "line 7: nuisance `k`: `absolute` is inf"),
            ("[nuisances.k]\nparameter = \"k\"\nrelative = 0.1\nabsolute = 1.0", "line 9: nuisance `k` says both"),
            (
                "[nuisances]\nk = { parameter = \"k\", relativ = 0.3 }",
                "line 7: unknown field `relativ`, expected one of `parameter`, `relative`, `absolute`, `per_shot`; did you mean `relative`?",
            ),
            ("[nuisances]\nk = 0.3", "line 7: "),
            ("[nuisances]\na = \"k\"\nb = \"k\"", "line 8: `a` and `b` in `[nuisances]` are both"),
            ("z = { variable = \"x\", noise = -1.0 }", "line 6: channel `z`: `noise` is -1"),
            ("z = { variable = \"x\", range = [3.0, 3.0] }", "line 6: channel `z`: `range` from 3 to 3 is empty"),
            ("z = { variable = \"x\", gain = nan }", "line 6: channel `z`: `gain` is NaN"),
            ("z = { variable = \"x\", scale = 0 }", "line 6: channel `z`: the scale 0"),
            ("z = { variable = \"x\", nois = 1.0 }", "line 6: unknown field `nois`"),
            ("z = { variable = \"x\", noise = 1e300 }", "line 6: channel `z`: `noise` is 1e300, larger than anything"),
            (
                "z = { variable = \"x\", scale = 1e-300 }",
                "line 6: channel `z`: the scale 1e-300 is not a ratio of units",
            ),
            (
                "z = { variable = \"x\", scale = -1e300 }",
                "line 6: channel `z`: the scale -1e300 is not a ratio of units",
            ),
            (
                "[nuisances]\nk = { parameter = \"k\", relative = 1e300 }",
                "line 7: nuisance `k`: `relative` is 1e300, larger",
            ),
            ("[shots]\ntime_scale = 1e-300", "line 7: `time_scale` is 1e-300, and no unit"),
            ("[shots]\ntime_scale = 1e300", "line 7: `time_scale` is 1e300, larger than anything"),
            ("time_s = { variable = \"x\" }", "line 6: channel `time_s` is the column of times"),
            ("[nuisances]\n\"\" = \"k\"", "line 7: a nuisance has no name"),
            ("z = { variable = \"\" }", "line 6: channel `z` names no variable"),
            ("[shots]\ntrigger_jitter = -1e-5", "line 7: `trigger_jitter` is -0.00001"),
            ("[shots]\ntrigger_jitter = nan", "line 7: `trigger_jitter` is NaN"),
            ("[shots]\ntime_scale = 0.0", "line 7: `time_scale` is 0"),
            ("[shots]\ntime_tolerance = -1", "line 7: `time_tolerance` is -1"),
            ("[shots]\ntrigger_moves = [\"t\"]", "line 7: `trigger_moves` names the condition `t`"),
            (
                "[shots]\nphases_of = \"Y\"",
                "line 7: `phases_of` names the channel `Y`, which the study does not have; did you mean `y`?",
            ),
            ("[shots]\nhold_out = [1, 1]", "line 7: `hold_out` names shot 1 twice"),
            ("[shots]\nmasks = [{ channels = [\"y_\"], from = 1.0 }]", "line 7: a mask names the channel `y_`"),
            (
                "[[shots.masks]]\nfrom = 1.0\n[[shots.masks]]\nafter_return_of = \"q\"",
                "line 9: a mask names the channel `q`",
            ),
            ("[[shots.masks]]\nfrom = 1.0\nbelow = 0.1", "line 8: `below` of a mask has no use"),
            ("[[shots.masks]]\nafter_return_of = \"y\"\nbelow = 5", "line 8: `below` of a mask is 5"),
            ("[[shots.masks]]\nfrom = 2.0\nto = 1.0", "line 7: a mask from 2 s to 1 s"),
            ("[[shots.masks]]\nfrom = nan", "line 7: `from` of a mask"),
            ("[[shots.masks]]\nchannels = [\"y\"]", "line 6: a mask says which part"),
            ("[[shots.masks]]\nfrom = 1.0\nwithin = -1.0", "line 8: a mask with `around` needs"),
            ("[[shots.masks]]\naround = [\"t\"]\nwithin = nan", "line 8: a mask with `around` needs"),
            ("[run]\nstart = inf", "line 7: the start of runs"),
            ("[run]\ntolerance = 1.0", "line 7: the tolerance 1"),
            ("[rnu]\ntolerance = 1e-6", "line 6: unknown field `rnu`"),
            ("[shots]\nhold_out = [-1]", "line 7: "),
        ] {
            let said = said(lines);
            assert!(said.starts_with(expected), "{lines}\n{said}");
        }
        for (class, is_name) in
            [("A.b_1", true), ("'my (own) \\'s;'.B", true), ("", false), ("A; end A; model B", false)]
        {
            assert_eq!(super::is_class_name(class), is_name, "{class}");
        }
        assert_eq!(said("[shots]\nmasks = [{ after_return_of = \"y\", below = 0.1 }, { from = -inf, to = 0.0 }]"), "");
    }
}
