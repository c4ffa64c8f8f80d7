//! Explanations of variables as text, and the page of the structure as data.
//!
//! Snapshots hold what `hyd equations --explain` prints for one variable of each kind; the page is checked to be one file that
//! holds the text of every place it links to.

use hyd_compiler::Goal;
use hyd_tests::models::{compile_file, messages};

/// File, and variables to explain.
const CASES: [(&str, &[&str]); 4] = [
    ("models/single_acting_drive/drive.hyd", &["y", "i", "ro.su.x", "ro.lc.L_e", "C", "ro.su.seat.upper"]),
    ("tests/numerics/car_axis.hyd", &["xl", "yl", "lambda1", "der(xr)"]),
    ("tests/numerics/pendulum.hyd", &["x", "tension"]),
    ("tests/numerics/slider_crank.hyd", &["lambda[2]", "q[3]", "phi1"]),
];

#[test]
fn explanations_of_variables() {
    for (file, variables) in CASES {
        let compilation = compile_file(file, &[], Goal::Check);
        assert!(!compilation.has_errors(), "{file}:\n{}", messages(&compilation));
        let explain = |name: &&str| compilation.explain(name).expect("sorted").unwrap_or_else(|error| error);
        let text: Vec<String> = variables.iter().map(explain).collect();
        let name = file.rsplit('/').next().and_then(|name| name.strip_suffix(".hyd")).expect("a model's file");
        insta::with_settings!({ prepend_module_to_snapshot => false, snapshot_path => "../../snapshots", omit_expression => true }, {
            insta::assert_snapshot!(format!("explain__{name}"), text.join("\n"));
        });
    }
}

#[test]
fn a_name_that_does_not_exist_is_answered_with_one_that_does() {
    let compilation = compile_file("tests/numerics/car_axis.hyd", &[], Goal::Check);
    let answer = compilation.explain("lamda1").expect("sorted").expect_err("no such variable");
    assert_eq!(answer, "there is no variable `lamda1` in the model; did you mean `lambda1`?");
}

#[test]
fn the_page_is_one_file_with_the_texts_it_links_to() {
    for (file, _) in CASES {
        let compilation = compile_file(file, &[], Goal::Check);
        let page = compilation.page().expect("sorted");
        assert!(!page.contains("src=") && !page.contains("http"), "{file}: the page loads something");
        assert!(!page.contains("/*DATA*/"), "{file}: the page has no data");
        let line = page.lines().find(|line| line.starts_with("const D = ")).expect("the data stand on one line");
        let json = line.trim_start_matches("const D = ").trim_end_matches(';');
        let data: serde_json::Value = serde_json::from_str(json).expect("the data are JSON");
        let (rows, files) = (data["rows"].as_array().expect("rows"), data["files"].as_array().expect("files"));
        assert_eq!(rows.len() as u64, data["total"].as_u64().expect("a number"));
        for place in rows.iter().flat_map(|row| [&row["at"], &row["d"]]) {
            let file = &files[place[0].as_u64().expect("a file") as usize];
            let lines = file["text"].as_str().expect("text").lines().count() as u64;
            assert!((1..=lines).contains(&place[1].as_u64().expect("a line")), "{place} leads nowhere");
        }
        // The order of solution: an explicit row reads only what stands before it, outside of blocks of several rows.
        let mut first = 0;
        for size in data["blocks"].as_array().expect("blocks").iter().map(|size| size.as_u64().expect("a size")) {
            for row in first..first + size {
                let entries = data["entries"][row as usize].as_array().expect("entries");
                let latest = entries.iter().filter_map(serde_json::Value::as_u64).max().unwrap_or(0);
                let explicit = rows[row as usize]["x"].as_bool() == Some(true);
                assert!(!explicit || latest < first + size, "{file}: row {row} reads column {latest}");
            }
            first += size;
        }
    }
}
