//! A record of a real machine as it stands in `tests/real`: balls dropped from a bridge and filmed.
//!
//! The folder of its effects is written in small letters, the package in it with a capital, as people do.

use std::fs;

use hyd_tests::models::root;

use super::{folder, hyd, json};

#[test]
fn balls_of_a_real_camera_have_drag() {
    let place = root().join("tests/real/balls");
    let own = |name: &str| place.join(name).display().to_string();
    let folder = folder("balls");
    let (study, set) = (own("bench.toml"), own("set.json"));
    let library = place.display().to_string();
    let found = hyd(&folder, &["discover", &study, "--bench", &set, "--library", &library, "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    let named: Vec<&str> =
        report["effects"].as_array().expect("a list").iter().filter_map(|own| own["id"].as_str()).collect();
    assert_eq!(report["status"], "named", "{}{}", found.stdout, found.stderr);
    assert!(named.contains(&"linear_drag") || named.contains(&"quadratic_drag"), "{named:?}");
    let _ = fs::remove_dir_all(&folder);
}
