//! What belongs to one shot alone, as files for runs of the written model: parameters, and recorded inputs.
//!
//! With them a run is the curve of the report, but for what the measuring chain makes of it, which comments say.

use std::fmt::Write;

use hyd_system::Hold;

use super::parameter_file::{line, plain};
use super::written::{Extended, SHOTS};
use super::{AllGaps, Gaps, Scene};
use crate::data::ChannelInfo;
use crate::problem::Problem;
use crate::unknowns::Meaning;

/// The files of a shot.
pub struct ShotFiles {
    /// Number given by the lab.
    pub number: usize,
    /// Name of the file of parameters in the folder of the report, with slashes.
    pub file: String,
    /// Its text.
    pub parameters: String,
    /// Name and text of the table of recorded inputs.
    pub inputs: Option<(String, String)>,
    /// What recorded inputs do between the rows of that table.
    pub holds: Vec<(String, Hold)>,
    /// When the run begins and ends (s).
    pub span: (f64, f64),
    /// What the measuring chain makes of each channel that was measured.
    pub shown: Vec<ShownChannel>,
    /// Further options of a run.
    pub options: String,
    /// The shot was fitted, not held out.
    pub is_fitted: bool,
}

/// A channel as the record shows it: `gain*expression(t - late - clock*t) + offset` within limits, in the units of the table; what else is
/// added to it over time is what then lacks of the curve of the report.
pub struct ShownChannel {
    /// Its name.
    pub name: String,
    /// Expression of the written model.
    pub expression: String,
    /// Units of the table per unit of the model, with the gain.
    pub gain: f64,
    /// Offset.
    pub offset: f64,
    /// How late the record is (s).
    pub late: f64,
    /// How much faster than true its clock runs, as a part.
    pub clock: f64,
    /// Smallest and largest number that is shown.
    pub limits: (f64, f64),
}

impl ShotFiles {
    /// The command that makes the run, with the names of files as `shown`.
    pub fn command(&self, model: &str, shown: &dyn Fn(&str) -> String) -> String {
        let inputs = self.inputs.as_ref().map_or_else(String::new, |(name, _)| format!(" --input {}", shown(name)));
        format!("hyd simulate {} --parameters {}{inputs}{}", shown(model), shown(&self.file), self.options)
    }
}

/// The files of all shots of which there are curves.
pub(super) fn shot_files(
    scene: &Scene<'_>,
    (gaps, extended): (&AllGaps, &Extended),
    problem: &Problem<'_>,
    model: &str,
) -> Vec<ShotFiles> {
    let setup = scene.setup;
    let mut files: Vec<ShotFiles> = Vec::new();
    for (shot, data) in setup.data.shots.iter().enumerate() {
        let is_fitted = setup.train.contains(&shot);
        let pick = |gaps: &Gaps| {
            if is_fitted { Some(gaps.train.xi.clone()) } else { Some(gaps.held_out.as_ref()?.xi.clone()) }
        };
        let Some(xi) = gaps.after.as_ref().and_then(pick) else { continue };
        // Several shots may have one number.
        let same = files.iter().filter(|own| own.number == data.number).count();
        let stem =
            if same == 0 { format!("shot_{}", data.number) } else { format!("shot_{}_{}", data.number, same + 1) };
        let (mut options, (start, stop)) = (String::new(), extended.span);
        // Writing to a String cannot fail.
        if data.span.start != start {
            let _ = write!(options, " --start {:?}", data.span.start);
        }
        if data.span.stop != stop {
            let _ = write!(options, " --stop {:?}", data.span.stop);
        }
        let recorded = setup.bench.shots[shot].input_table((data.span.start.min(start), data.span.stop.max(stop)));
        let (text, holds) = recorded.map_or_else(Default::default, |(text, holds)| (Some(text), holds));
        for (name, hold) in holds.iter().filter(|(_, hold)| *hold != Hold::default()) {
            let _ = write!(options, " --hold {}", quoted(&format!("{name}={}", hold.name())));
        }
        let inputs = text.map(|text| (format!("{SHOTS}/{stem}_inputs.csv"), text));
        let file = format!("{SHOTS}/{stem}.toml");
        let span = (data.span.start, data.span.stop);
        let shown = shown(scene, (extended, problem), (&xi, shot));
        let (number, own) = (data.number, String::new());
        let mut own = ShotFiles { number, file, parameters: own, inputs, holds, span, shown, options, is_fitted };
        own.parameters = parameters(scene, (extended, problem), (&xi, shot), &own.command(model, &quoted));
        files.push(own);
    }
    files
}

/// A word for a shell.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./=:+,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// The text of the parameters: what a study decides shot by shot, what was fitted for this one, and whatever else is not as in the
/// model's text.
fn parameters(
    scene: &Scene<'_>,
    (extended, problem): (&Extended, &Problem<'_>),
    (xi, shot): (&[f64], usize),
    command: &str,
) -> String {
    let (setup, data) = (scene.setup, &scene.setup.data.shots[shot]);
    let kind = if setup.train.contains(&shot) { "fitted" } else { "held out; what belongs to it alone was fitted" };
    let mut text = format!("# shot {} ({kind}), for the folder of the report:\n# {}\n", data.number, plain(command));
    for (k, value) in problem.values(xi, shot).into_iter().enumerate() {
        let name = problem.places[k].name();
        let is_own = setup.study.conditions.contains_key(name)
            || problem.unknowns.iter().any(|own| own.shot == Some(shot) && own.places().contains(&k));
        let is_stated = problem.machine.parameter(name).is_ok_and(|(_, stated)| stated == value);
        if is_own || !is_stated {
            text.push_str(&line(problem, k, value));
        }
    }
    text.push_str(&chain(scene, (extended, problem), (xi, shot)));
    text
}

/// What the measuring chain makes of the channels that were measured.
fn shown(
    scene: &Scene<'_>,
    (extended, problem): (&Extended, &Problem<'_>),
    (xi, shot): (&[f64], usize),
) -> Vec<ShownChannel> {
    let (setup, data) = (scene.setup, &scene.setup.data.shots[shot]);
    let measured = setup.data.channels.iter().enumerate().filter(|&(k, _)| data.traces[k].is_some());
    let one = |(k, info): (usize, &ChannelInfo)| {
        let chain = problem.chain(xi, shot, k);
        let ends = (info.limits.0 * info.scale, info.limits.1 * info.scale);
        ShownChannel {
            name: info.name.clone(),
            expression: extended.channels[k].clone(),
            gain: chain.gain * info.scale,
            offset: chain.offset * info.scale,
            late: chain.late,
            clock: chain.clock,
            limits: (ends.0.min(ends.1), ends.0.max(ends.1)),
        }
    };
    measured.map(one).collect()
}

/// What the measuring chain makes of a run, as comments.
fn chain(scene: &Scene<'_>, (extended, problem): (&Extended, &Problem<'_>), (xi, shot): (&[f64], usize)) -> String {
    let (setup, data) = (scene.setup, &scene.setup.data.shots[shot]);
    let mut text = String::from("# what the report shows of a run, in the units of the table:\n");
    // Writing to a String cannot fail.
    for (k, info) in setup.data.channels.iter().enumerate().filter(|&(k, _)| data.traces[k].is_some()) {
        let chain = problem.chain(xi, shot, k);
        let (gain, offset) = (chain.gain, chain.offset);
        let mut shown = format!("({})", extended.channels[k]);
        if gain != 1.0 {
            shown = format!("{gain:?}*{shown}");
        }
        if offset != 0.0 {
            shown = format!("{shown} {} {:?}", if offset < 0.0 { '-' } else { '+' }, offset.abs());
        }
        if info.scale != 1.0 {
            shown = format!("{:?}*({shown})", info.scale);
        }
        let (low, high) = (info.limits.0 * info.scale, info.limits.1 * info.scale);
        let mut ends = [low.min(high), low.max(high)].into_iter().filter(|end| end.is_finite()).peekable();
        if ends.peek().is_some() {
            let ends: Vec<String> = ends.map(|end| format!("{end:?}")).collect();
            shown = format!("{shown}, no farther than {}", ends.join(" and "));
        }
        let unit = if info.unit.is_empty() { String::new() } else { format!(" {}", info.unit) };
        let _ = writeln!(text, "#   {}", plain(&format!("{} = {shown}{unit}", info.name)));
    }
    for (unknown, &xi) in problem.unknowns.iter().zip(xi).filter(|(own, _)| own.touches(shot)) {
        let value = unknown.value(xi);
        let line = match &unknown.meaning {
            Meaning::Course { channel, .. } => {
                let info = &setup.data.channels[*channel];
                format!("beside it {}: {:?} {}", unknown.name, value * info.scale, info.unit)
            }
            Meaning::Late { places, .. } if places.is_empty() && value != 0.0 => {
                format!("the record is {value:?} s late: its time t is the time t - {value:?} s of the run")
            }
            Meaning::Lag { channel, .. } => {
                format!("{} is {value:?} s late beside it", setup.data.channels[*channel].name)
            }
            Meaning::Clock { .. } => {
                format!("the clock of the record runs fast: its time t is the time {:?}*t of the run", 1.0 - value)
            }
            _ => continue,
        };
        let _ = writeln!(text, "# {}", plain(&line));
    }
    text
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::quoted;

    #[test]
    fn words_of_commands_are_quoted_where_a_shell_would_read_them() {
        assert_eq!(quoted("a/b_1.toml"), "a/b_1.toml");
        assert_eq!(quoted("my folder/it's"), "'my folder/it'\\''s'");
    }
}
