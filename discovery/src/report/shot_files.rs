//! What belongs to one shot alone, as files for runs of the written model: parameters, and recorded inputs.
//!
//! With them a run is the curve of the report, but for what the measuring chain makes of it, which comments say.

use std::fmt::Write;

use hyd_system::{Hold, Series};

use super::parameter_file::{line, plain};
use super::written::{Extended, SHOTS};
use super::{AllGaps, Gaps, Scene};
use crate::problem::Problem;
use crate::unknowns::Meaning;

/// Rows between two samples of a spline that cannot be given by its samples.
const BETWEEN: usize = 8;
/// Part of the distance of rows by which times differ that are the same but for rounding.
const SAME: f64 = 1e-9;

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
    /// Further options of a run.
    pub options: String,
    /// The shot was fitted, not held out.
    pub is_fitted: bool,
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
        let recorded: Vec<(&str, &Series)> =
            setup.bench.shots[shot].inputs.iter().map(|(name, series)| (name.as_str(), &**series)).collect();
        let inputs = (!recorded.is_empty()).then(|| {
            let (text, holds) = table(&recorded, (data.span.start.min(start), data.span.stop.max(stop)));
            for (name, hold) in holds.iter().filter(|(_, hold)| *hold != Hold::default()) {
                let _ = write!(options, " --hold {}", quoted(&format!("{name}={}", hold.name())));
            }
            (format!("{SHOTS}/{stem}_inputs.csv"), text)
        });
        let file = format!("{SHOTS}/{stem}.toml");
        let mut own = ShotFiles { number: data.number, file, parameters: String::new(), inputs, options, is_fitted };
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

/// Samples of inputs as a table that covers a time, and what they do between its rows.
fn table(inputs: &[(&str, &Series)], (start, stop): (f64, f64)) -> (String, Vec<(String, Hold)>) {
    let mut times: Vec<f64> =
        inputs.iter().flat_map(|(_, series)| series.times()).copied().chain([start, stop]).collect();
    times.sort_unstable_by(f64::total_cmp);
    let step = (times[times.len() - 1] - times[0]) / times.len() as f64;
    // Of times that differ by rounding the last one: by then all held values have jumped.
    let mut rows: Vec<f64> = Vec::with_capacity(times.len());
    for time in times {
        match rows.last_mut() {
            Some(last) if time - *last <= SAME * step => *last = time,
            _ => rows.push(time),
        }
    }
    // A spline through more points than its samples is another one; in between the rows of a dense table lie on straight lines.
    let is_exact = |series: &Series| series.hold() != Hold::Smooth || series.times() == rows;
    let exact: Vec<bool> = inputs.iter().map(|(_, series)| is_exact(series)).collect();
    if exact.contains(&false) {
        let between = |pair: &[f64]| -> Vec<f64> {
            (0..BETWEEN).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / BETWEEN as f64).collect()
        };
        let last = rows[rows.len() - 1];
        rows = rows.windows(2).flat_map(between).chain([last]).collect();
    }
    let holds = inputs.iter().zip(&exact).map(|((name, series), exact)| {
        // Splines that are exact are given by rows that are not their samples once others are dense.
        let is_spline = series.hold() == Hold::Smooth;
        let hold = if is_spline && (!exact || series.times() != rows) { Hold::Linear } else { series.hold() };
        (name.to_string(), hold)
    });
    let holds = holds.collect();
    let field = |name: &str| {
        if name.contains([',', '"', '\n']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_string() }
    };
    let mut text = String::from("time");
    inputs.iter().for_each(|(name, _)| text.extend([",", &field(name)]));
    text.push('\n');
    for time in rows {
        // Writing to a String cannot fail.
        let _ = write!(text, "{time:?}");
        for (_, series) in inputs {
            let last = series.values()[series.values().len() - 1];
            let value = if time >= series.span().1 { last } else { series.at(time, series.interval(time, 0)).value };
            let _ = write!(text, ",{value:?}");
        }
        text.push('\n');
    }
    (text, holds)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Hold, Series, quoted, table};

    /// Rows of a table behind its header.
    fn rows(text: &str) -> Vec<Vec<f64>> {
        text.lines().skip(1).map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect()
    }

    #[test]
    fn inputs_of_other_clocks_stand_in_one_table() {
        let line = Series::new(vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 0.0], Hold::Linear).unwrap();
        let steps = Series::new(vec![0.5, 1.5, 2.5], vec![1.0, 3.0, 5.0], Hold::Zero).unwrap();
        let (text, holds) = table(&[("u[1,2]", &line), ("s", &steps)], (-1.0, 2.0));
        assert!(text.starts_with("time,\"u[1,2]\",s\n-1.0,0.0,1.0\n"), "{text}");
        let wanted = [
            [-1.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
            [0.5, 1.0, 1.0],
            [1.0, 2.0, 1.0],
            [1.5, 1.0, 3.0],
            [2.0, 0.0, 3.0],
            [2.5, 0.0, 5.0],
        ];
        let found: Vec<Vec<f64>> = rows(&text.replace("\"u[1,2]\"", "u"));
        assert_eq!(found, wanted);
        assert_eq!(holds, [("u[1,2]".to_string(), Hold::Linear), ("s".to_string(), Hold::Zero)]);
    }

    #[test]
    fn splines_keep_their_samples_or_become_dense() {
        let times: Vec<f64> = (0..21).map(|k| 0.05 * f64::from(k)).collect();
        let smooth = Series::new(times.clone(), times.iter().map(|t| (6.0 * t).sin()).collect(), Hold::Smooth).unwrap();
        let (text, holds) = table(&[("u", &smooth)], (0.0, 1.0));
        assert_eq!((rows(&text).len(), holds[0].1), (21, Hold::Smooth));
        // It must hold its end for longer.
        let (text, holds) = table(&[("u", &smooth)], (0.0, 1.5));
        assert_eq!(holds[0].1, Hold::Linear);
        for row in rows(&text) {
            let wanted = (6.0 * row[0].min(1.0)).sin();
            assert!((row[1] - wanted).abs() < 2e-3, "{row:?} instead of {wanted}");
        }
    }

    #[test]
    fn words_of_commands_are_quoted_where_a_shell_would_read_them() {
        assert_eq!(quoted("a/b_1.toml"), "a/b_1.toml");
        assert_eq!(quoted("my folder/it's"), "'my folder/it'\\''s'");
    }
}
