//! Names mean nothing: with components, classes, places and effect called otherwise the same is found.

use std::fs;

use hyd_tests::models::root;

use crate::{OWN_LIBRARY, folder, report_of, thinned};

/// Words and what takes their place: the package, a class, components, the place at which the leak is.
const NAMES: [(&str, &str); 6] = [
    ("SingleActingDrive", "Lifter"),
    ("HY", "OilSide"),
    ("hy", "wet_part"),
    ("sh", "poppet"),
    ("ro", "puller"),
    ("leakage", "seam"),
];

/// The text with whole words replaced.
fn renamed(text: &str) -> String {
    let mut result = String::new();
    let mut word = String::new();
    for letter in text.chars().chain(std::iter::once('\n')) {
        if letter.is_alphanumeric() || letter == '_' {
            word.push(letter);
            continue;
        }
        let other = NAMES.iter().find(|(old, _)| *old == word).map(|(_, new)| *new);
        result.push_str(other.unwrap_or(&word));
        word.clear();
        result.push(letter);
    }
    result.pop();
    result
}

#[test]
fn the_same_is_found_under_other_names() {
    let found = |name: &str, rename: bool| {
        let of = |text: String| if rename { renamed(&text) } else { text };
        let folder = folder(name);
        fs::create_dir_all(folder.join("libraries/Workshop")).expect("made");
        fs::write(folder.join("libraries/Workshop/package.hyd"), of(OWN_LIBRARY.to_string())).expect("written");
        for entry in fs::read_dir(root().join("models/single_acting_drive")).expect("there") {
            let path = entry.expect("readable").path();
            let file = path.file_name().expect("named").to_string_lossy().into_owned();
            let target = if rename && file == "hy.hyd" { "oilside.hyd".to_string() } else { file };
            if path.extension().is_some_and(|extension| extension == "hyd") {
                fs::write(folder.join(target), of(fs::read_to_string(&path).expect("readable"))).expect("written");
            }
        }
        let study = fs::read_to_string(root().join("models/single_acting_drive/bench.toml")).expect("readable");
        let study = study.replace("[models]", "without = [\"Hyd.Effects\"]\n\n[models]");
        fs::write(folder.join("study.toml"), of(study)).expect("written");
        let report = report_of(&folder, &thinned(&folder, "bench/B03", 4));
        let _ = fs::remove_dir_all(&folder);
        report
    };
    let (plain, other) = (found("plain", false), found("renamed", true));
    assert_eq!((&plain["status"], &other["status"]), (&"named".into(), &"named".into()), "{other:#}");
    let number = |report: &serde_json::Value, path: &str| report.pointer(path).and_then(serde_json::Value::as_f64);
    for path in ["/effects/0/parameters/k/value", "/gap/train/after", "/gap/heldout/after", "/gap/heldout/before"] {
        let (one, two) = (number(&plain, path).expect("a number"), number(&other, path).expect("a number"));
        assert!((one / two - 1.0).abs() < 1e-3, "{path}: {one} and {two}");
    }
    let component = |report: &serde_json::Value| report["effects"][0]["component"].as_str().map(str::to_string);
    let own = component(&plain).expect("a component");
    assert_ne!(component(&other), Some(own.clone()), "nothing was renamed");
    assert_eq!(component(&other), Some(renamed(&own)));
    let place = |report: &serde_json::Value| report["location"][0]["equation"].as_str().map(renamed);
    assert_eq!(place(&other), place(&plain));
}
