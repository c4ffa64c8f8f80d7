//! Runs killed at random moments: what bears the name of the result is the whole result, or is not there.
//!
//! 200 kills, spread over a run's length, over the formats and a sweep.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::scratch::{Scratch, messages};

/// Many rows, so that writing takes most of the time.
const WAVES: &str = "model Waves
  Real x[20](each start = 1, each fixed = true), v[20](each start = 0, each fixed = true);
equation
  for i in 1:20 loop
    der(x[i]) = v[i];
    der(v[i]) = -i*x[i];
  end for;
  annotation(experiment(StopTime = 20));
end Waves;
";
const KILLS: usize = 50;

/// Numbers between 0 and 1 (Knuth 1998, MMIX).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Kills the program after a part of the time it takes; true if it was still running.
fn kill(scratch: &Scratch, arguments: &[&str], after: Duration) -> bool {
    let mut command = Command::new(scratch.file("waves"));
    command.args(arguments).current_dir(scratch.file("")).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    std::thread::sleep(after);
    let running = child.try_wait().unwrap().is_none();
    let _ = child.kill();
    child.wait().unwrap();
    running
}

fn built() -> Scratch {
    let scratch = Scratch::new();
    fs::write(scratch.file("waves.hyd"), WAVES).unwrap();
    let output = scratch.hyd(&["build", "waves.hyd", "-o", "waves"]);
    assert!(output.status.success(), "{}", messages(&output));
    scratch
}

#[test]
fn a_killed_run_leaves_the_whole_result_or_none() {
    let (scratch, mut random) = (built(), Random(7));
    let mut killed = 0;
    for name in ["r.csv", "r.mat", "r.parquet"] {
        let arguments = ["--result", name, "--intervals", "5000"];
        let begin = Instant::now();
        assert!(scratch.bare("waves", &arguments).status.success());
        let (time, whole) = (begin.elapsed(), fs::read(scratch.file(name)).unwrap());
        for _ in 0..KILLS {
            fs::remove_file(scratch.file(name)).unwrap_or(());
            killed += usize::from(kill(&scratch, &arguments, time.mul_f64(1.1 * random.next())));
            if let Ok(left) = fs::read(scratch.file(name)) {
                assert!(left == whole, "{name}: {} of {} bytes", left.len(), whole.len());
            }
        }
    }
    assert!(killed > KILLS, "{killed} runs were killed");
}

#[test]
fn a_killed_sweep_goes_on_and_never_claims_to_be_whole() {
    let (scratch, mut random) = (built(), Random(8));
    // Parameters are needed to vary something.
    let text = WAVES.replace("  Real x", "  parameter Real v0 = 0;\n  Real x").replace("-i*x[i]", "v0 - i*x[i]");
    fs::write(scratch.file("waves.hyd"), text).unwrap();
    assert!(scratch.hyd(&["build", "waves.hyd", "-o", "waves"]).status.success());
    let arguments = |folder| ["sweep", "--vary", "v0=0:1:100", "--result", folder];
    let begin = Instant::now();
    let output = scratch.bare("waves", &arguments("whole"));
    assert!(output.status.success(), "{}", messages(&output));
    let (time, whole) = (begin.elapsed(), fs::read(scratch.file("whole/members.parquet")).unwrap());
    let again = arguments("killed");
    for _ in 0..KILLS {
        kill(&scratch, &again, time.mul_f64(0.4 * random.next()));
        if let Ok(left) = fs::read(scratch.file("killed/members.parquet")) {
            assert!(left == whole);
            fs::remove_dir_all(scratch.file("killed")).unwrap();
        }
    }
    assert!(scratch.bare("waves", &again).status.success());
    assert!(fs::read(scratch.file("killed/members.parquet")).unwrap() == whole);
}
