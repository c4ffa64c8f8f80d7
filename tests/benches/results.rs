//! What results cost: rows of a large and of a small model, and files of them in every format.
//!
//! Run with `cargo bench -p hyd-tests --bench results`.  The chain of 10,000 orifices and volumes of `tests/scale` for 0.1 s, and the
//! drive, each with 500 output intervals at a tolerance of 1e-6.  Times are CPU seconds of the process, the least of three runs; a run
//! with one output interval is what the solver takes.  Sizes are megabytes (10^6 bytes): of the values that columns hold, 8 bytes
//! each, and of files.

use std::path::PathBuf;

use hyd::clock::cpu_seconds;
use hyd_compiler::CompiledModel;
use hyd_frames::{Frame, RunStream};
use hyd_results::{Discard, ResultFile, Sink, columns, is_variable};
use hyd_runtime::simulate;
use hyd_system::DaeSystem;
use hyd_tests::runs::{on_grid, translated};
use hyd_tests::scale::Case;

fn main() {
    println!("\n## Results\n");
    println!(
        "| model | columns | format | CPU s | of which the file | file MB | MB/s of values | MB/s of the file | one column back, ms |"
    );
    println!("|---|---:|---|---:|---:|---:|---:|---:|---:|");
    let chain = Case::find("chain, array").expect("a case of the list").text(10_000).translate();
    measure("chain", chain.model.as_ref().expect("translated"), 0.1);
    let drive = translated("models/single_acting_drive/drive.hyd", &[]);
    measure("drive", drive.model.as_ref().expect("translated"), 0.05);
}

/// The least CPU time of three runs.
fn best(mut run: impl FnMut() -> f64) -> f64 {
    (0..3).map(|_| run()).fold(f64::INFINITY, f64::min)
}

fn run(model: &CompiledModel, stop: f64, intervals: usize, sink: &mut dyn Sink) -> f64 {
    let mut system = model.instantiate();
    let start = cpu_seconds();
    simulate(&mut system, &on_grid(stop, intervals, 1e-6), sink, &|| false).expect("runs");
    cpu_seconds() - start
}

fn measure(name: &str, model: &CompiledModel, stop: f64) {
    let count = columns(model.tables(), is_variable).len();
    let outputs = model.instantiate().structure().outputs;
    let solver = best(|| run(model, stop, 1, &mut Discard));
    let rows = best(|| run(model, stop, 500, &mut Discard));
    let each = 1e9 * (rows - solver) / (499 * outputs) as f64;
    println!(
        "| {name} | {count} | none | {rows:.4} | rows: {:.4}, {each:.1} ns a value of {outputs} | | | | |",
        rows - solver
    );
    let values = 8e-6 * (501 * (count + 1)) as f64;
    for format in ["csv", "mat", "parquet"] {
        let path: PathBuf = std::env::temp_dir().join(format!("hyd-results-{}.{format}", std::process::id()));
        let seconds = best(|| {
            let start = cpu_seconds();
            let mut file = match format {
                "parquet" => ResultFile::with(&path, |file| Ok(Box::new(RunStream::new(file, &path, is_variable)))),
                _ => ResultFile::create(&path, is_variable),
            }
            .expect("made");
            run(model, stop, 500, &mut file);
            file.complete().expect("written");
            cpu_seconds() - start
        });
        let own = seconds - rows;
        let size = 1e-6 * std::fs::metadata(&path).expect("there").len() as f64;
        let back = (format == "parquet").then(|| {
            let name = columns(model.tables(), is_variable).pop().expect("a column").name;
            1e3 * best(|| {
                let start = cpu_seconds();
                Frame::read_columns(&path, |other| other == name).expect("readable");
                cpu_seconds() - start
            })
        });
        let back = back.map_or_else(String::new, |ms| format!("{ms:.1}"));
        println!(
            "| {name} | {count} | {format} | {seconds:.4} | {own:.4} | {size:.2} | {:.0} | {:.0} | {back} |",
            values / own,
            size / own
        );
        std::fs::remove_file(&path).expect("removed");
    }
}
