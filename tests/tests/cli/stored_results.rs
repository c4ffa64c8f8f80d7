//! `hyd test`: models against results stored beside them; what a stored result says, written here by the closed form, counts.

use std::fmt::Write as _;

use crate::process::{Scratch, run};

const DECAY: &str = "model Decay\n  parameter Real k = 2;\n  Real x(start = 1, fixed = true);\n  Real twice = 2*x;\nequation\n  \
                     der(x) = -k*x;\n  annotation(experiment(StopTime = 1, Interval = 0.05));\nend Decay;\n";

/// `x = exp(-k t)` over a second.
fn decay(k: f64) -> String {
    let mut text = String::from("time,x\n");
    for n in 0..=20 {
        let time = 0.05 * f64::from(n);
        let _ = writeln!(text, "{time},{}", (-k * time).exp());
    }
    text
}

#[test]
fn a_model_is_compared_with_its_stored_result() {
    let folder = Scratch::new();
    std::fs::create_dir(folder.path().join("models")).expect("made");
    folder.write("models/decay.hyd", DECAY);
    folder.write("models/broken.hyd", DECAY.replace("Decay", "Broken").replace("der(x) = -k*x", "der(x) = -kk*x"));
    folder.write("models/part.hyd", "model Part\n  Real x;\nend Part;\n");
    // Nothing is stored: that is said, and is not a success.
    let outcome = run(folder.path(), &["test", "models/decay.hyd"]);
    assert_eq!(outcome.code, Some(1), "{}", outcome.stdout);
    assert!(
        outcome.stdout.contains("1 model, 0 failed, 1 without a stored result (--accept stores one)"),
        "{}",
        outcome.stdout
    );
    // What is stored counts, and only that.
    folder.write("models/decay.expected.csv", decay(2.0));
    let outcome = run(folder.path(), &["test", "models/decay.hyd"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stdout);
    assert!(outcome.stdout.starts_with("ok      models/decay.hyd ("), "{}", outcome.stdout);
    folder.write("models/decay.expected.csv", decay(2.1));
    let outcome = run(folder.path(), &["test", "models", "--junit", "tests.xml"]);
    assert_eq!(outcome.code, Some(1), "{}", outcome.stdout);
    // exp(-2t) - exp(-2.1t) is largest near t = 1/2.
    assert!(
        outcome.stdout.contains("FAILED  models/decay.hyd") && outcome.stdout.contains("x differs by 1.7"),
        "{}",
        outcome.stdout
    );
    assert!(
        outcome.stdout.contains("new     models/broken.hyd") && !outcome.stdout.contains("part.hyd"),
        "{}",
        outcome.stdout
    );
    let junit = folder.read("tests.xml");
    let document = roxmltree::Document::parse(&junit).expect("XML");
    let suite = document.root_element();
    let count = |name: &str| suite.attribute(name).and_then(|text| text.parse::<usize>().ok());
    assert_eq!((count("tests"), count("failures"), count("skipped")), (Some(2), Some(1), Some(1)), "{junit}");
    let failure = document.descendants().find(|node| node.has_tag_name("failure")).expect("a failure");
    assert!(failure.attribute("message").is_some_and(|text| text.starts_with("x differs by")), "{junit}");
}

#[test]
fn what_is_accepted_is_stored_with_a_picture() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    let outcome = run(folder.path(), &["test", ".", "--accept"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stdout);
    let first = folder.read("decay.expected.csv");
    assert!(first.lines().next().is_some_and(|line| line.contains("twice")), "{first}");
    assert_eq!(run(folder.path(), &["test", "."]).code, Some(0));
    // What changes is said, drawn, and stored; the columns stay those that were stored.
    folder.write("decay.expected.csv", decay(3.0));
    let outcome = run(folder.path(), &["test", ".", "--accept"]);
    assert!(
        outcome.stdout.contains("stored  ./decay.hyd") && outcome.stdout.contains("x differs by"),
        "{}",
        outcome.stdout
    );
    let picture = folder.read("decay.changed.svg");
    assert!(picture.contains("<svg") && picture.contains(">now<") && picture.contains("decay.expected"), "{picture}");
    let header = folder.read("decay.expected.csv").lines().next().map(str::to_string);
    assert_eq!(header.as_deref(), Some("time,x"));
    assert_eq!(run(folder.path(), &["test", "."]).code, Some(0));
    // A variable that is gone, a run that became shorter, a text that is wrong.
    folder.write("decay.expected.csv", "time,x,gone\n0,1,1\n2,0.02,1\n");
    let outcome = run(folder.path(), &["test", "."]);
    assert_eq!(outcome.code, Some(1));
    let words = ["runs from 0 to 1 s, and what is stored from 0 to 2 s", "no `gone` any more"];
    assert!(words.iter().all(|part| outcome.stdout.contains(part)), "{}", outcome.stdout);
    folder.write("decay.hyd", DECAY.replace("-k*x", "-kk*x"));
    let outcome = run(folder.path(), &["test", "."]);
    assert!(
        outcome.stdout.contains("error[E0201]") && outcome.stdout.contains("at ./decay.hyd:6"),
        "{}",
        outcome.stdout
    );
    let outcome = run(folder.path(), &["test", "decay.hyd", "--limit", "0"]);
    assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
    let outcome = run(folder.path(), &["test", "nowhere"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("no file or folder `nowhere`"), "{}", outcome.stderr);
}

#[test]
fn a_run_without_an_end_is_stopped() {
    let folder = Scratch::new();
    let text = "model Long\n  Real x(start = 1, fixed = true);\n  Real y(start = 0, fixed = true);\nequation\n  der(x) = 1e6*y;\n  \
                der(y) = -1e6*x;\n  annotation(experiment(StopTime = 1e9));\nend Long;\n";
    folder.write("long.hyd", text);
    folder.write("long.expected.csv", "time,x\n0,1\n1,1\n");
    let outcome = run(folder.path(), &["test", "long.hyd", "--limit", "0.3"]);
    assert!(outcome.code == Some(1) && outcome.stdout.contains("stopped after 0.3 s (--limit)"), "{}", outcome.stdout);
}
