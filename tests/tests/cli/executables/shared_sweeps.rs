//! Sweeps shared out to other machines: by hand, and by a queue of a few lines of shell that has the names and the answers of Slurm's
//! programs.  Real engines are tried by `tests/outside/cluster`.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use super::scratch::{Scratch, messages, printed};

/// Fails where k is negative.
const DECAY: &str = "model Decay
  parameter Real k(min = 0) = 1;
  parameter Integer n = 1;
  input Real u = 0;
  Real x[n](each start = 1, each fixed = true);
equation
  for i in 1:n loop
    der(x[i]) = -k*x[i] + u;
  end for;
end Decay;
";
const PLAN: &str = "model = \"decay.hyd\"\nsamples = 90\nseed = 3\nmeasure = [\"min(x[2])\"]\n[set]\nn = \"2\"\n[[vary]]\nparameter = \"k\"\n\
                    values = \"uniform(-0.1, 1)\"\n";

fn folder() -> Scratch {
    let scratch = Scratch::new();
    fs::write(scratch.file("decay.hyd"), DECAY).unwrap();
    fs::write(scratch.file("plan.toml"), PLAN).unwrap();
    scratch
}

fn read(scratch: &Scratch, name: &str) -> Vec<u8> {
    fs::read(scratch.file(name)).unwrap()
}

#[track_caller]
fn well(output: &Output) -> String {
    assert!(output.status.success(), "{}", messages(output));
    printed(output)
}

#[track_caller]
fn ill(output: &Output, code: i32, message: &str) {
    assert_eq!(output.status.code(), Some(code), "{}", messages(output));
    assert!(messages(output).contains(message), "{}", messages(output));
}

#[test]
fn shards_by_hand_are_the_sweep_of_one_process() {
    let scratch = folder();
    let whole = scratch.hyd(&["sweep", "plan.toml", "--rows", "--result", "whole"]);
    assert!(messages(&whole).starts_with("warning: 8 runs failed\n"), "{}", messages(&whole));
    let ready = ["sweep", "plan.toml", "--rows", "--shards", "4", "--result", "s"];
    let told = well(&scratch.hyd(&ready));
    assert!(told.starts_with("4 shards are ready; I from 0 to 3:\n"), "{told}");
    ill(&scratch.hyd(&ready), 1, "`s` holds a sweep that was shared out before; --on ENGINE --resume goes on with it");
    // Neither texts nor libraries nor an environment are needed.
    fs::rename(scratch.file("decay.hyd"), scratch.file("hidden")).unwrap();
    let shard = |k: &str| scratch.bare("s/submission/model", &["shard", "s", k]);
    for k in ["2", "0", "3", "2"] {
        assert!(well(&shard(k)).contains(" runs done"));
    }
    ill(&scratch.hyd(&["sweep", "merge", "s"]), 1, "1 of 4 chunks have not been run");
    assert_eq!(well(&shard("1")), "23 runs done; 2 failed\n");
    assert_eq!(well(&shard("1")), "23 runs done, 23 of them before; 2 failed\n");
    ill(&shard("4"), 2, "shard 4: there are 4, the first of which is 0");
    ill(&scratch.bare("s/submission/model", &["shard", "s"]), 2, "required arguments were not provided");
    well(&scratch.hyd(&["sweep", "merge", "s"]));
    for file in ["members.parquet", "rows.parquet"] {
        assert!(read(&scratch, &format!("whole/{file}")) == read(&scratch, &format!("s/{file}")), "{file}");
    }
    // A file with members of another one, and one that is cut off.
    let part = "s/parts/members-000002.parquet";
    let own = read(&scratch, part);
    fs::copy(scratch.file("s/parts/members-000001.parquet"), scratch.file(part)).unwrap();
    ill(&scratch.hyd(&["sweep", "merge", "s"]), 1, "it does not hold the members that it is named for");
    fs::write(scratch.file(part), &own[..own.len() / 2]).unwrap();
    ill(&scratch.hyd(&["sweep", "merge", "s"]), 1, "members-000002.parquet`: ");
    fs::remove_file(scratch.file(part)).unwrap();
    well(&shard("2"));
    assert!(read(&scratch, part) == own);
}

#[test]
fn inputs_and_whole_loops_are_shipped() {
    let scratch = folder();
    fs::write(scratch.file("u.csv"), "time,u\n0,0\n0.3,0.1234567890123456789\n0.5,\n1,1e-300\n").unwrap();
    fs::write(scratch.file("driven.hyd"), DECAY.replace("input Real u = 0;", "input Real u;")).unwrap();
    let options = ["sweep", "driven.hyd", "--vary", "k=0:1:20", "--input", "u.csv", "--hold", "u=smooth"];
    let swept = |rest: &[&str]| scratch.hyd(&[&options[..], rest].concat());
    swept(&["--result", "whole"]);
    well(&swept(&["--shards", "3", "--result", "s"]));
    for k in ["0", "1", "2"] {
        well(&scratch.bare("s/submission/model", &["shard", "s", k]));
    }
    well(&scratch.hyd(&["sweep", "merge", "s"]));
    assert!(read(&scratch, "whole/members.parquet") == read(&scratch, "s/members.parquet"));

    let text = hyd_tests::models::text_of("tests/cases/networks/late.hyd");
    let text = text.replace("parameter Integer n = 60;", "parameter Integer n = 60;\n  parameter Real large = 1000;");
    fs::write(scratch.file("late.hyd"), text.replace("then 1000", "then large")).unwrap();
    let options = ["sweep", "late.hyd", "--vary", "large=0,1000,0.5,400", "--rows", "--intervals", "4"];
    let swept = |rest: &[&str]| scratch.hyd(&[&options[..], rest].concat());
    let alone = swept(&["--result", "late"]);
    assert!(
        messages(&alone).contains("a loop of equations could not be solved one variable after the other in 2 runs")
    );
    well(&swept(&["--shards", "2", "--result", "t"]));
    for k in ["0", "1"] {
        let output = scratch.bare("t/submission/model", &["shard", "t", k]);
        assert_eq!((well(&output).as_str(), messages(&output).as_str()), ("2 runs done; 0 failed\n", ""));
    }
    well(&scratch.hyd(&["sweep", "merge", "t"]));
    for file in ["members.parquet", "rows.parquet"] {
        assert!(read(&scratch, &format!("late/{file}")) == read(&scratch, &format!("t/{file}")), "{file}");
    }
    // Who goes on with what others have run hears of it, too.
    let again = swept(&["--result", "t"]);
    assert_eq!(messages(&again), messages(&alone));
}

#[test]
fn what_cannot_be_shared_out_is_refused_and_leaves_nothing() {
    let cases: [(&[&str], i32, &str); 9] = [
        (
            &["--on", "pbs"],
            2,
            "--on: `pbs` is not an engine; expected hq, hq=SERVER_DIR, slurm, dask, dask=ADDRESS or here",
        ),
        (&["--on", "slurm", "--shards", "10001"], 2, "--shards: 10001 is not a number from 1 to 10000"),
        (&["--on", "slurm", "--settle", "-1"], 2, "--settle"),
        (&["--resume"], 2, "--on"),
        (&["--on", "slurm"], 1, "there is no `scontrol` on this machine, the program by which Slurm is reached"),
        (&["--on", "hq"], 1, "there is no `hq` on this machine, the program by which HyperQueue is reached"),
        (
            &["--on", "dask=tcp://127.0.0.1:1"],
            1,
            "there is no `python3` on this machine, the program by which Dask is reached",
        ),
        (&["--on", "hq", "--resume"], 1, "`s` holds no sweep that was shared out"),
        (&["--shards", "2", "--shard", "0/2"], 2, "--shard: a share of a sweep is not shared out again"),
    ];
    for (arguments, code, message) in cases {
        let scratch = folder();
        let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
        command.args(["sweep", "plan.toml", "--result", "s"]).args(arguments).env("PATH", "");
        command.env("HYD_LAUNCHER", env!("CARGO_BIN_EXE_hyd-launcher-under-test"));
        let output = command.current_dir(scratch.file("")).stdin(Stdio::null()).output().unwrap();
        ill(&output, code, message);
        assert!(!scratch.file("s").exists(), "{arguments:?}");
    }
    let scratch = folder();
    ill(&scratch.hyd(&["sweep", "cancel"]), 2, "hyd sweep cancel DIR: which folder?");
    ill(&scratch.hyd(&["sweep", "cancel", "nowhere"]), 1, "`nowhere` holds no sweep that was shared out");
    let search = ["discover", "study.toml", "--bench", "set.json", "--report", "r", "--shards", "3"];
    ill(&scratch.hyd(&search), 2, "--on <ENGINE>");
}

/// A queue in a folder.
struct Queue {
    scratch: Scratch,
}

impl Queue {
    fn new() -> Self {
        let scratch = folder();
        hyd_tests::queue::make(&scratch.file("queue")).unwrap();
        Self { scratch }
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
        let bin = self.scratch.file("queue/bin");
        let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
        command.env("HYD_LAUNCHER", env!("CARGO_BIN_EXE_hyd-launcher-under-test")).env("PATH", path);
        command.args(arguments).current_dir(self.scratch.file("")).stdin(Stdio::null());
        command
    }

    fn hyd(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn file(&self, name: &str) -> PathBuf {
        self.scratch.file(name)
    }
}

#[test]
fn a_queue_gives_the_table_of_one_process_whatever_gets_lost() {
    let queue = Queue::new();
    let alone = queue.hyd(&["sweep", "plan.toml", "--result", "whole"]);
    // Two tasks end without a word before they have begun, and no other task takes them up.
    fs::write(queue.file("queue/hurried"), "").unwrap();
    fs::write(queue.file("queue/lost.1"), "").unwrap();
    fs::write(queue.file("queue/lost.4"), "").unwrap();
    let options = ["sweep", "plan.toml", "--on", "slurm", "--shards", "6", "--settle", "0.5", "--result", "s"];
    let output = queue.hyd(&options);
    let told = messages(&output);
    assert_eq!(well(&output), printed(&alone).replace("whole/", "s/"));
    let lost = "failed and is run again: it ended without its results and without a word";
    assert!(
        told.contains(&format!("warning: shard 1 {lost}")) && told.contains(&format!("warning: shard 4 {lost}")),
        "{told}"
    );
    assert!(told.ends_with(&messages(&alone)), "{told}");
    assert!(read(&queue.scratch, "whole/members.parquet") == read(&queue.scratch, "s/members.parquet"));
    assert!(fs::read_dir(queue.file("s/submission/logs")).unwrap().next().is_none());
    let jobs = fs::read_to_string(queue.file("s/submission/jobs.jsonl")).unwrap();
    assert!(jobs.starts_with("{\"engine\":\"slurm\",\"jobs\":[\""), "{jobs}");
    let many = ["sweep", "plan.toml", "--on", "slurm", "--shards", "102", "--samples", "200", "--result", "t"];
    ill(&queue.hyd(&many), 2, "102 tasks are more than 101, which is MaxArraySize of this Slurm");
    assert!(!queue.file("t").exists());
    ill(&queue.hyd(&options), 1, "`s` holds a sweep that was shared out before; --resume goes on with it");
    let again = queue.hyd(&[&options[..], &["--resume"]].concat());
    assert!(well(&again).starts_with("90 of 90 runs done, 90 of them before; 8 failed\n"), "{}", printed(&again));
    assert_eq!(messages(&again), messages(&alone));
    let mut other = options;
    other[5] = "5";
    ill(&queue.hyd(&[&other[..], &["--resume"]].concat()), 2, "--shards: the sweep was shared out to 6 and not to 5");
}

#[test]
fn a_job_that_is_done_goes_on_with_others() {
    let queue = Queue::new();
    fs::write(queue.file("queue/single"), "").unwrap();
    well(&queue.hyd(&["sweep", "plan.toml", "--result", "whole"]));
    let options = ["sweep", "plan.toml", "--on", "slurm", "--shards", "30", "--result", "s"];
    assert_eq!(messages(&queue.hyd(&options)), messages(&queue.hyd(&["sweep", "plan.toml", "--result", "other"])));
    assert!(read(&queue.scratch, "whole/members.parquet") == read(&queue.scratch, "s/members.parquet"));
    // The first job makes all shards; a second one may have begun before the others were taken back.
    let begun = fs::read_to_string(queue.file("queue/begun")).unwrap();
    assert!(begun == "0\n" || begun == "0\n1\n", "{begun}");
    let queued = fs::read_dir(queue.file("queue")).unwrap().flatten();
    let queued: Vec<_> =
        queued.map(|own| own.file_name()).filter(|own| own.to_string_lossy().starts_with("task.")).collect();
    assert!(queued.is_empty(), "still in the queue: {queued:?}");
    assert!(fs::read_dir(queue.file("s/submission/logs")).unwrap().next().is_none());
}

#[test]
fn a_damaged_part_is_set_aside_and_a_shard_that_always_fails_is_given_up() {
    let queue = Queue::new();
    queue.hyd(&["sweep", "plan.toml", "--result", "whole"]);
    let options = ["sweep", "plan.toml", "--on", "slurm", "--shards", "3", "--settle", "0.3", "--result", "s"];
    well(&queue.hyd(&options));
    let part = queue.file("s/parts/members-000001.parquet");
    let own = fs::read(&part).unwrap();
    fs::write(&part, &own[..own.len() / 2]).unwrap();
    fs::remove_file(queue.file("s/parts/members-000002.parquet")).unwrap();
    let resumed = queue.hyd(&[&options[..], &["--resume"]].concat());
    assert!(well(&resumed).starts_with("90 of 90 runs done, 30 of them before; 8 failed\n"), "{}", printed(&resumed));
    assert!(messages(&resumed).contains("a part of the results is damaged"), "{}", messages(&resumed));
    assert!(read(&queue.scratch, "whole/members.parquet") == read(&queue.scratch, "s/members.parquet"));

    // A disk that takes no file of more than a block.
    fs::remove_file(&part).unwrap();
    fs::write(queue.file("queue/full.1"), "").unwrap();
    let full = queue.hyd(&[&options[..], &["--resume"]].concat());
    let given = "1 of 3 shards failed 3 times each and were given up; --resume tries them again; shard 1: error: results cannot be \
                 written: File too large";
    ill(&full, 1, given);
    assert!(messages(&full).contains("warning: shard 1 failed and is run again: error: results cannot be written"));
    fs::remove_file(queue.file("queue/full.1")).unwrap();
    let changed = queue.file("s/submission/model");
    let bytes = fs::read(&changed).unwrap();
    fs::write(&changed, &bytes[1..]).unwrap();
    ill(&queue.hyd(&[&options[..], &["--resume"]].concat()), 1, "is not the file that was shipped");
    fs::write(&changed, &bytes).unwrap();
    well(&queue.hyd(&[&options[..], &["--resume"]].concat()));
    assert!(read(&queue.scratch, "whole/members.parquet") == read(&queue.scratch, "s/members.parquet"));
    let hidden = fs::read_dir(queue.file("s/parts")).unwrap().flatten();
    assert!(hidden.into_iter().all(|entry| !entry.file_name().to_string_lossy().starts_with('.')));
}

#[test]
fn processes_on_this_machine_need_no_engine() {
    let scratch = folder();
    let alone = scratch.hyd(&["sweep", "plan.toml", "--result", "whole"]);
    let here = scratch.hyd(&["sweep", "plan.toml", "--on", "here", "--shards", "4", "--result", "s"]);
    assert_eq!(well(&here), printed(&alone).replace("whole/", "s/"));
    assert_eq!(messages(&here), messages(&alone));
    assert!(read(&scratch, "whole/members.parquet") == read(&scratch, "s/members.parquet"));
    ill(&scratch.hyd(&["sweep", "cancel", "s"]), 1, "tasks of `here` belong to the command that has submitted them");
}
