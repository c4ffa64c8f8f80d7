//! Runs whose input is a recorded file, beside the same equations with the input as an expression.
//!
//! Run with `cargo build --release && cargo bench -p hyd-tests --bench inputs [-- HYD]`; each run is a fresh process of `target/release/hyd` (or
//! HYD), with the file read and results written.  A stiffening oscillator (Duffing, natural frequency 103 Hz) follows five sines, sampled
//! 131,072 times at 610.35 Hz, as in the records of the Silverbox benchmark (Wigren, Schoukens, European Control Conference 2013).
//! Times are wall times, the least of several runs taken in turns, because other programs only add to them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use hyd_tests::models::root;

const RATE: f64 = 610.35;
const SAMPLES: usize = 131_072;
/// Frequencies (Hz) and phases of sines of 0.04.
const SINES: [(f64, f64); 5] = [(13.1, 0.1), (29.7, 1.2), (53.3, 2.3), (71.9, 3.4), (97.1, 4.5)];
/// Turns in which the runs are timed.
const TURNS: usize = 5;
/// What a run with an input may cost of one without.
const WANTED: f64 = 1.5;

fn main() {
    let given = std::env::args().skip(1).find(|argument| !argument.starts_with("--"));
    let hyd = given.map_or_else(|| root().join("target/release/hyd"), PathBuf::from);
    assert!(hyd.exists(), "`cargo build --release` makes {}", hyd.display());
    let folder = std::env::temp_dir().join(format!("hyd-inputs-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("written");
        path
    };
    let sines: Vec<String> =
        SINES.iter().map(|(f, phase)| format!("0.04*sin({}*time + {phase})", std::f64::consts::TAU * f)).collect();
    let expression = write("expression.mo", &model("Real u", &format!("u = {};", sines.join(" + "))));
    let recorded = write("recorded.mo", &model("input Real u", ""));
    let mut table = "time,u\n".to_string();
    for t in (0..SAMPLES).map(|k| k as f64 / RATE) {
        let u: f64 = SINES.iter().map(|(f, phase)| 0.04 * (std::f64::consts::TAU * f * t + phase).sin()).sum();
        writeln!(table, "{t:.9},{u:.9}").expect("a string takes everything");
    }
    let samples = write("samples.csv", &table);
    let result = folder.join("result.csv");

    let holds = ["linear", "zero", "smooth"];
    let mut best = [f64::INFINITY; 4];
    for _ in 0..TURNS {
        best[0] = best[0].min(run(&hyd, &expression, &[], &result));
        for (best, hold) in best[1..].iter_mut().zip(holds) {
            *best = best.min(run(&hyd, &recorded, &["--input", text(&samples), "--hold", hold], &result));
        }
    }
    println!(
        "\n## {SAMPLES} samples of an input\n\n| input | seconds | of an expression | wanted |\n|---|---:|---:|---:|"
    );
    println!("| an expression | {:.2} | 1 | |", best[0]);
    for (seconds, hold) in best[1..].iter().zip(holds) {
        println!("| recorded, {hold} | {seconds:.2} | {:.2} | {WANTED} |", seconds / best[0]);
    }
    if let Err(error) = std::fs::remove_dir_all(&folder) {
        eprintln!("{} stays: {error}", folder.display());
    }
}

fn model(input: &str, equation: &str) -> String {
    format!(
        "model Oscillator
  {input};
  Real y(start = 0, fixed = true); Real v(start = 0, fixed = true);
equation
  der(y) = v;
  der(v) = (u - 2.5e-3*v - y - 3.9*y^3)/2.4e-6;
  {equation}
  annotation(experiment(StopTime = 214, Tolerance = 1e-4, Interval = 1.6384e-3));
end Oscillator;
"
    )
}

/// Seconds of one run as a process.
fn run(hyd: &Path, file: &Path, options: &[&str], result: &Path) -> f64 {
    let begin = Instant::now();
    let mut command = Command::new(hyd);
    command.args(["simulate", text(file)]).args(options).args(["--result", text(result)]);
    let status = command.stdout(Stdio::null()).status().expect("started");
    assert!(status.success(), "{command:?}");
    begin.elapsed().as_secs_f64()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("names of temporary folders are text")
}
