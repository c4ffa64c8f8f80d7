//! Executables and sweeps: time from text to executable, size, time from start to first step, rate of a sweep on all cores.
//!
//! Run with `cargo build --release && cargo bench -p hyd-tests --bench executables`; it uses `target/release/hyd` and
//! its launcher.  Times are wall times, the least of several runs, because other programs only add to them.  A sweep is
//! wanted at 1.9 times the rate of one core.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use hyd_tests::models::root;

const DRIVE: &str = "models/single_acting_drive/drive.hyd";
/// Runs of the sweep.
const RUNS: usize = 1000;

fn main() {
    let hyd = root().join("target/release/hyd");
    assert!(hyd.exists(), "`cargo build --release` makes {}", hyd.display());
    let folder = std::env::temp_dir().join(format!("hyd-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let program = folder.join("drive");
    let drive = root().join(DRIVE);

    let build = least(15, || run(&hyd, &["build", text(&drive), "-o", text(&program)]));
    let size = std::fs::metadata(&program).expect("built").len();
    // A run of one nanosecond: start, consistent values, the first step.
    let first = least(30, || run(&program, &["--stop", "1e-9"]));
    let whole = least(15, || run(&program, &[]));
    let interpreted = least(5, || run(&program, &["--backend", "vm"]));
    println!("\n## Executables\n\n| what | value | wanted |\n|---|---:|---:|");
    println!("| text to executable, the drive | {:.0} ms | 100 ms |", 1e3 * build);
    println!("| size of the executable | {:.2} MB | 8 MB |", size as f64 / 1e6);
    println!("| start of the program to the first step | {:.1} ms | 15 ms |", 1e3 * first);
    println!("| a whole run, native | {:.1} ms | |", 1e3 * whole);
    println!("| a whole run, interpreted | {:.1} ms | |", 1e3 * interpreted);

    println!(
        "\n## {RUNS} runs of the drive\n\n| who | seconds | runs per second | of one core |\n|---|---:|---:|---:|"
    );
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let sweep = |runs: usize, threads: usize, name: &str| {
        let result = folder.join(name);
        let threads = threads.to_string();
        let values = format!("p0=8e6:12e6:{runs}");
        let begin = Instant::now();
        run(
            &program,
            &["sweep", "--vary", &values, "--variables", "^y$", "--threads", &threads, "--result", text(&result)],
        );
        let seconds = begin.elapsed().as_secs_f64();
        remove(&result);
        seconds
    };
    // In turns, because the rate of a machine that others share drifts.
    let (mut one, mut all, mut apart) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    for _ in 0..4 {
        one = one.min(sweep(RUNS, 1, "one"));
        all = all.min(sweep(RUNS, cores, "all"));
        apart = apart.min(side_by_side(cores, |part| sweep(RUNS / cores, 1, &format!("part-{part}"))));
    }
    let rows = [
        ("one thread".to_string(), one),
        (format!("{cores} threads"), all),
        (format!("{cores} programs of one thread"), apart),
    ];
    for (who, seconds) in rows {
        println!("| {who} | {seconds:.2} | {:.0} | {:.2} |", RUNS as f64 / seconds, one / seconds);
    }
    remove(&folder);
}

/// Seconds until all of `count` pieces of work that share nothing are done: what the machine gives at best.
fn side_by_side(count: usize, work: impl Fn(usize) -> f64 + Sync) -> f64 {
    let begin = Instant::now();
    std::thread::scope(|scope| {
        for part in 0..count {
            let work = &work;
            scope.spawn(move || work(part));
        }
    });
    begin.elapsed().as_secs_f64()
}

fn least(times: usize, mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let begin = Instant::now();
        work();
        begin.elapsed().as_secs_f64()
    };
    (0..times).map(time).fold(f64::INFINITY, f64::min)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path that is text")
}

fn run(program: &Path, arguments: &[&str]) {
    let status = Command::new(program).args(arguments).stdout(Stdio::null()).status();
    assert!(status.is_ok_and(|status| status.success()), "{} {arguments:?}", program.display());
}

fn remove(folder: &Path) {
    std::fs::remove_dir_all(folder).expect("removed");
}
