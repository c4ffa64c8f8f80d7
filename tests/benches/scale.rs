//! Translation of models of N equal parts: time of each stage, memory and code, with the fitted exponents of N.
//!
//! Run with `cargo bench -p hyd-tests --bench scale`; `-- WORDS` takes the cases whose names contain one of the words,
//! `--most N` bounds the number of variables (1e6 without), `--race` measures the goals of a million states and of
//! chains alone.  Every figure comes from a process of its own, so that peaks of memory are its own; times are CPU
//! seconds from text to code, the least of up to three runs. Exponents are slopes of straight lines through the
//! logarithms from 10,000 variables on.

use std::process::Command;

use hyd::clock::cpu_seconds;
use hyd_results::Discard;
use hyd_runtime::simulate;
use hyd_tests::runs::on_grid;
use hyd_tests::scale::{CASES, Case};

/// From here on exponents are fitted.
const FITTED: f64 = 9e3;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let Some(at) = arguments.iter().position(|argument| argument == "--case") {
        return one_case(&arguments[at + 1], arguments[at + 2].parse().expect("a number"), arguments.get(at + 3));
    }
    if arguments.iter().any(|argument| argument == "--race") {
        return race();
    }
    let mut most = 1_000_000;
    let mut words: Vec<&str> = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--most" => most = rest.next().and_then(|number| number.parse().ok()).expect("--most NUMBER"),
            word => words.push(word),
        }
    }
    println!("\n## Translation of N equal parts\n");
    header();
    for case in CASES {
        if words.is_empty() || words.iter().any(|word| case.name.contains(word)) {
            decades(case, most);
        }
    }
}

/// What one process measured.
struct Figures {
    variables: f64,
    unknowns: f64,
    templates: f64,
    code: f64,
    seconds: f64,
    peak: f64,
    simulation: Option<f64>,
    stages: Vec<(String, f64)>,
}

/// The child: prints `name value` per line.
fn one_case(name: &str, parts: usize, simulated: Option<&String>) {
    let case = Case::find(name).expect("a case of the list");
    let text = case.text(parts);
    let start = cpu_seconds();
    let compilation = text.translate();
    println!("seconds {}", cpu_seconds() - start);
    println!("peak {}", peak_of_memory());
    let model = compilation.model.as_ref().expect("translated");
    println!("variables {}", compilation.flat.as_ref().map_or(0, |flat| flat.scalars));
    println!("unknowns {}", compilation.sorted.as_ref().map_or(0, |sorted| sorted.simulation.unknowns.len()));
    println!("templates {}\ncode {}", model.statistics().templates, model.statistics().code_bytes);
    for stage in &compilation.times {
        println!("stage {} {}", stage.name.replace(' ', "_"), stage.seconds);
    }
    if let Some(stop) = simulated {
        let mut system = model.instantiate();
        let start = cpu_seconds();
        let options = on_grid(stop.parse().expect("a number"), 100, 1e-6);
        let summary = simulate(&mut system, &options, &mut Discard, &|| false).expect("runs");
        println!("simulation {}\nsteps {}", cpu_seconds() - start, summary.statistics.steps);
        println!("peak {}", peak_of_memory());
    }
}

/// The most memory that this process has held, in MB; 0 where the system does not tell.
fn peak_of_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0)
}

/// Runs the child and reads what it printed.
fn measure(case: Case, parts: usize, simulated: Option<f64>) -> Figures {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["--case", case.name, &parts.to_string()]);
    command.args(simulated.map(|stop| stop.to_string()));
    let output = command.output().expect("the child runs");
    assert!(output.status.success(), "{} of {parts}: {}", case.name, String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let words = |line: &str| line.split(' ').map(str::to_string).collect::<Vec<_>>();
    let lines: Vec<Vec<String>> = text.lines().map(words).collect();
    // The last line of a name counts.
    let value = |name: &str| lines.iter().rfind(|line| line[0] == name).and_then(|line| line[1].parse().ok());
    let stages = lines.iter().filter(|line| line[0] == "stage");
    Figures {
        variables: value("variables").unwrap_or(0.0),
        unknowns: value("unknowns").unwrap_or(0.0),
        templates: value("templates").unwrap_or(0.0),
        code: value("code").unwrap_or(0.0),
        seconds: value("seconds").expect("printed"),
        peak: value("peak").expect("printed"),
        simulation: value("simulation"),
        stages: stages.map(|line| (line[1].replace('_', " "), line[2].parse().unwrap_or(0.0))).collect(),
    }
}

/// The least time of some runs.
fn best(case: Case, parts: usize, simulated: Option<f64>) -> Figures {
    let mut best = measure(case, parts, simulated);
    let repeats = if best.seconds < 1.0 { 2 } else { usize::from(best.seconds < 10.0) };
    for _ in 0..repeats {
        let next = measure(case, parts, simulated);
        for (stage, other) in best.stages.iter_mut().zip(&next.stages) {
            stage.1 = stage.1.min(other.1);
        }
        best.seconds = best.seconds.min(next.seconds);
        best.simulation = best.simulation.zip(next.simulation).map(|(a, b)| a.min(b));
    }
    best
}

fn header() {
    println!(
        "| model | N | variables | unknowns | templates | bytes of code | peak MB | seconds | parse, instantiate, flatten | units | \
         aliases, index, sort, differentiate | code |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    );
}

fn row(name: &str, parts: usize, f: &Figures) {
    let of = |names: &[&str]| {
        let found = f.stages.iter().filter(|stage| names.contains(&stage.0.as_str()));
        found.map(|stage| stage.1).sum::<f64>()
    };
    println!(
        "| {name} | {parts} | {} | {} | {} | {} | {:.0} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
        f.variables,
        f.unknowns,
        f.templates,
        f.code,
        f.peak,
        f.seconds,
        of(&["parse", "instantiate", "flatten"]),
        of(&["check units"]),
        of(&["eliminate aliases", "reduce index", "sort", "differentiate"]),
        of(&["generate code"]),
    );
}

/// Four decades of N.
fn decades(case: Case, most: usize) {
    let mut found: Vec<Figures> = Vec::new();
    for decade in (0..4).rev() {
        let parts = most / 10usize.pow(decade) / case.variables;
        if parts < 2 {
            continue;
        }
        let figures = best(case, parts, None);
        row(case.name, parts, &figures);
        found.push(figures);
    }
    let fit = |value: fn(&Figures) -> f64| {
        let fitted = found.iter().filter(|figures| figures.variables >= FITTED);
        slope(&fitted.map(|figures| (figures.variables.ln(), value(figures).ln())).collect::<Vec<_>>())
    };
    println!(
        "| {}, exponents | | | | | | {:.2} | **{:.2}** | | | | |",
        case.name,
        fit(|figures| figures.peak),
        fit(|figures| figures.seconds)
    );
}

/// The slope of a straight line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / count, sum.1 + point.1 / count));
    let product = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>();
    product(&|p| (p.0 - mean.0) * (p.1 - mean.1)) / product(&|p| (p.0 - mean.0) * (p.0 - mean.0))
}

/// 1.6 million states of oscillators; 10,000 orifices and volumes, translated and run for 0.1 s.
fn race() {
    println!("\n## Large models\n");
    header();
    let case = |name| Case::find(name).expect("a case of the list");
    for name in ["oscillators, for", "oscillators, array"] {
        row(name, 800_000, &best(case(name), 800_000, None));
    }
    for name in ["chain, array", "chain, by hand"] {
        let figures = best(case(name), 10_000, Some(0.1));
        row(name, 10_000, &figures);
        println!("| ... simulation, seconds | | | | | | | {:.3} | | | | |", figures.simulation.unwrap_or(f64::NAN));
    }
}
