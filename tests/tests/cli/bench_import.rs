//! `hyd bench`: folders of files imported, imported again, refused; and the page of a set.

use std::fmt::Write as _;
use std::fs;

use crate::process::{Scratch, assert_no_panic, run};

/// A shot as a laboratory writes it.
fn shot(change: impl Fn(&str) -> String) -> String {
    let mut text = String::from("Rig 2\nForce [kN];0,5\nt;p;Trig\nms;bar;V\n");
    for k in 0..200 {
        let p = 100 + (k * 7919) % 13 + if k > 50 { k } else { 0 };
        writeln!(text, "{k},0;{p},5;{}", if k > 50 { 5 } else { 0 }).unwrap();
    }
    change(&text)
}

fn folder(scratch: &Scratch) {
    fs::create_dir(scratch.path().join("raw")).unwrap();
    for k in [1, 2] {
        scratch.write(&format!("raw/shot{k}.csv"), shot(str::to_string));
    }
}

#[test]
fn a_folder_is_imported_and_imported_again() {
    let scratch = Scratch::new();
    folder(&scratch);
    scratch.write("raw/photo.jpg", "x");
    let made = run(scratch.path(), &["bench", "import", "raw"]);
    assert_eq!((made.code, made.stderr.as_str()), (Some(0), ""));
    assert!(made.stdout.contains("the edge of `Trig` at 0.0505 s is time 0"), "{}", made.stdout);
    assert!(made.stdout.contains("left out, because they are not tables: `photo.jpg`"), "{}", made.stdout);
    let table = scratch.read("raw_bench/shot1.csv");
    assert!(table.starts_with("time_s,p,Trig\n-0.0505,10050000,0\n"), "{table}");
    let set: serde_json::Value = serde_json::from_str(&scratch.read("raw_bench/set.json")).unwrap();
    assert_eq!(set["experiments"][1]["Force"].as_f64(), Some(500.0));

    // Edited and imported again: what is written before is replaced, the study stays.
    scratch.write("raw_bench/study.toml", "mine");
    let edited = scratch.read("raw_bench/import.toml").replace("name = \"p\"", "name = \"pressure\"");
    scratch.write("raw_bench/import.toml", &edited);
    let again = run(scratch.path(), &["bench", "import", "raw_bench/import.toml"]);
    assert_eq!((again.code, again.stderr.as_str()), (Some(0), ""));
    assert!(scratch.read("raw_bench/shot1.csv").starts_with("time_s,pressure,Trig\n"));
    assert_eq!(scratch.read("raw_bench/study.toml"), "mine");
    assert_eq!(scratch.read("raw_bench/import.toml"), edited);

    // A set that a person has edited is not written over, nor is a folder.
    let set = scratch.read("raw_bench/set.json").replace("\"shot\": 2", "\"shot\": 3");
    scratch.write("raw_bench/set.json", &set);
    let refused = run(scratch.path(), &["bench", "import", "raw_bench/import.toml"]);
    assert_eq!(refused.code, Some(1));
    assert!(
        refused.stderr.starts_with("error: `raw_bench/set.json` was edited since it was imported"),
        "{}",
        refused.stderr
    );
    assert_eq!(scratch.read("raw_bench/set.json"), set);
    let refused = run(scratch.path(), &["bench", "import", "raw"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("`raw_bench` exists already"), "{}", refused.stderr);
    // Into another folder, with an import file that finds the files from there.
    fs::create_dir(scratch.path().join("deep")).unwrap();
    let other = run(scratch.path(), &["bench", "import", "raw_bench/import.toml", "-o", "deep/other"]);
    assert_eq!((other.code, other.stderr.as_str()), (Some(0), ""));
    assert!(scratch.read("deep/other/import.toml").contains("folder = \"../../raw\""));
    assert_eq!(run(scratch.path(), &["bench", "import", "deep/other/import.toml"]).code, Some(0));
}

#[test]
fn inputs_are_never_written_over() {
    let scratch = Scratch::new();
    folder(&scratch);
    assert_eq!(run(scratch.path(), &["bench", "import", "raw", "-o", "out"]).code, Some(0));
    let text = scratch.read("out/import.toml").replace("\"../raw\"", "\".\"");
    scratch.write("raw/import.toml", &text);
    let before = scratch.read("raw/shot1.csv");
    let refused = run(scratch.path(), &["bench", "import", "raw/import.toml"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("`raw/shot1.csv` exists and was not made by an import"), "{}", refused.stderr);
    assert_eq!(scratch.read("raw/shot1.csv"), before);
    assert!(!scratch.path().join("raw/set.json").exists());
}

/// Notes beside the tables are no shots, and say so.
#[test]
fn texts_without_numbers_are_left_out_by_name() {
    let scratch = Scratch::new();
    folder(&scratch);
    scratch.write("raw/notes.txt", "Shot 1 was warm.\nShot 2 was cold.\n");
    let made = run(scratch.path(), &["bench", "import", "raw"]);
    let said = "warning: `raw/notes.txt` is left out: line 1: no rows of numbers were found; it is not a table of measurements\n";
    assert_eq!((made.code, made.stderr.as_str()), (Some(0), said));
    assert!(!scratch.read("raw_bench/import.toml").contains("notes.txt"));
    assert_eq!(run(scratch.path(), &["bench", "import", "raw_bench/import.toml"]).stderr, "");
}

#[test]
fn bad_folders_end_in_a_sentence_and_leave_nothing() {
    let late = |from: &str, to: &str| shot(|text| text.replacen(from, to, 1));
    let cases: [(&str, String, &str); 8] = [
        ("a.png", "x".into(), "`raw` holds no tables of measurements"),
        ("a.csv", String::new(), "`raw/a.csv`: the file is empty"),
        ("a.csv", " ".repeat(100 << 20), "`raw/a.csv`: line 1: the file holds nothing but blanks"),
        ("a.csv", late("99,0;", "98,0;"), "`raw/a.csv`: line 104, column `t`: the time stands twice"),
        ("a.csv", late("99,0;", "3,0;"), "`raw/a.csv`: line 104, column `t`: the time goes back"),
        ("a.csv", late("t;p;Trig", "t;p;p"), "`raw/a.csv`: line 3: the columns 2 and 3 are both called `p`"),
        (
            "a.csv",
            shot(|text| text.replace(";5\n", ";on\n")),
            "`raw/a.csv`: line 56, column `Trig`: `on` is not a number",
        ),
        ("a.mat", "nonsense".into(), "`raw/a.mat`: "),
    ];
    for (name, text, expected) in cases {
        let scratch = Scratch::new();
        fs::create_dir(scratch.path().join("raw")).unwrap();
        scratch.write(&format!("raw/{name}"), &text);
        let refused = run(scratch.path(), &["bench", "import", "raw"]);
        assert_no_panic(&refused);
        assert_eq!(refused.code, Some(1), "{}", refused.stderr);
        assert!(refused.stderr.starts_with(&format!("error: {expected}")), "{}", refused.stderr);
        assert_eq!(scratch.names(), ["raw"]);
    }
    let scratch = Scratch::new();
    folder(&scratch);
    assert_eq!(run(scratch.path(), &["bench", "import", "raw"]).code, Some(0));
    let text = scratch.read("raw_bench/import.toml").replace("decimal = ", "decimals = ");
    scratch.write("import.toml", &text);
    let refused = run(scratch.path(), &["bench", "import", "import.toml"]);
    assert_eq!(refused.code, Some(1));
    let line = text.lines().position(|line| line.starts_with("decimals")).unwrap() + 1;
    let expected = format!("error: `import.toml`: line {line}: unknown field `decimals`");
    assert!(
        refused.stderr.starts_with(&expected) && refused.stderr.contains("did you mean `decimal`?"),
        "{}",
        refused.stderr
    );
    assert_eq!(run(scratch.path(), &["bench", "import", "raw", "--rate", "-1"]).code, Some(2));
}

#[test]
fn the_page_of_a_set_says_what_stands_out() {
    let scratch = Scratch::new();
    folder(&scratch);
    assert_eq!(run(scratch.path(), &["bench", "import", "raw", "-o", "out"]).code, Some(0));
    let shown = run(scratch.path(), &["bench", "show", "out/set.json", "-o", "page.html"]);
    assert_eq!((shown.code, shown.stderr.as_str()), (Some(0), ""));
    assert!(shown.stdout.ends_with("2 channels of 2 shots in page.html\n"), "{}", shown.stdout);
    let page = scratch.read("page.html");
    assert!(
        page.contains("\"title\"") && !page.contains("/*DATA*/") && !page.contains("src=") && !page.contains("href="),
        "a page without a network"
    );
    // The page is not written over a table that it shows.
    let refused = run(scratch.path(), &["bench", "show", "out/set.json", "-o", "out/shot1.csv"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("which this command reads"), "{}", refused.stderr);
    scratch.write("empty.json", "{}");
    let refused = run(scratch.path(), &["bench", "show", "empty.json"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("missing field `experiments`"), "{}", refused.stderr);
}
