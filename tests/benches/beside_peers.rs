//! `hyd` as the programs of `benchmarks/peers` run: `beside_peers (auto|bdf|esdirk) (drive|line|cord) TOLERANCE CELLS FILE`.
//!
//! Prints CPU seconds (best of up to 20 runs in one process, each with its rows kept), steps and rejected steps; writes
//! samples `t,value,...` to FILE, in the scaled units of the peers.  Called by `benchmarks/peers/run.py`.

use std::fmt::Write as _;

use hyd::clock::cpu_seconds;
use hyd_results::Trajectory;
use hyd_runtime::{Options, Simulator, Solver};
use hyd_system::DaeSystem;
use hyd_tests::runs::{instance, on_grid, translated};

/// CPU seconds after which no more runs are made, and most runs, as the peers do it.
const ENOUGH: f64 = 1.0;
const MOST: usize = 20;

/// A problem: file, end (s), samples, and the variables compared, each with its factor to the units of the peers.
struct Problem {
    file: &'static str,
    stop: f64,
    samples: usize,
    variables: Vec<(String, f64)>,
}

fn problem(name: &str, cells: usize) -> Problem {
    let middle = cells / 2;
    let states = ["q", "i", "x", "v", "p", "y", "w", "p_s"];
    match name {
        "drive" => Problem {
            file: "benchmarks/peers/models/drive.hyd",
            stop: 0.08,
            samples: 80,
            variables: states.map(|state| (state.to_string(), 1.0)).to_vec(),
        },
        "line" => Problem {
            file: "models/hydraulic_line/line.hyd",
            stop: 0.1,
            samples: 50,
            variables: vec![("q[1]".into(), 1e3), (format!("p[{middle}]"), 1e-6), (format!("p[{cells}]"), 1e-6)],
        },
        _ => Problem {
            file: "benchmarks/peers/models/cord.hyd",
            stop: 5.0,
            samples: 50,
            variables: [1, middle, cells].map(|k| (format!("y[{k}]"), 1.0)).to_vec(),
        },
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [method, name, tolerance, cells, file] = arguments.as_slice() else {
        println!("usage: beside_peers (auto|bdf|esdirk) (drive|line|cord) TOLERANCE CELLS FILE");
        return;
    };
    let problem = problem(name, cells.parse().expect("a number of cells"));
    let set: Vec<(&str, &str)> = if name == "drive" { Vec::new() } else { vec![("N", cells.as_str())] };
    let compilation = translated(problem.file, &set);
    let mut system = instance(&compilation, &set);
    let solver = match method.as_str() {
        "bdf" => Solver::Bdf,
        "esdirk" => Solver::Esdirk,
        _ => Solver::Auto,
    };
    let tolerance = tolerance.parse().expect("a tolerance");
    let options = Options { solver, ..on_grid(problem.stop, problem.samples, tolerance) };
    let (mut best, mut spent, mut runs, mut counts, mut rows) = (f64::MAX, 0.0, 0, (0, 0), Trajectory::new());
    while runs == 0 || (spent < ENOUGH && runs < MOST) {
        let start = cpu_seconds();
        let mut simulator = Simulator::new(system.structure());
        simulator.run(&mut system, &options, &mut rows, &|| false).unwrap_or_else(|error| panic!("{error}"));
        let seconds = cpu_seconds() - start;
        let statistics = simulator.statistics();
        (best, spent, runs) = (best.min(seconds), spent + seconds, runs + 1);
        counts = (statistics.steps, statistics.error_rejections);
    }
    let columns = problem.variables.iter().map(|(name, factor)| {
        let values = rows.series(name).expect("recorded").values();
        values.into_iter().map(|value| factor * value).collect::<Vec<f64>>()
    });
    let columns: Vec<Vec<f64>> = columns.collect();
    let mut text = String::new();
    for (k, &t) in rows.times().iter().enumerate().filter(|(_, t)| **t > 0.0) {
        let _ = write!(text, "{t:e}");
        for column in &columns {
            let _ = write!(text, ",{:.17e}", column[k]);
        }
        text.push('\n');
    }
    std::fs::write(file, text).expect("written");
    println!("{best:.6} {} {}", counts.0, counts.1);
}
