//! Studies whose numbers make no sense end with the line at fault, never with a misfit.

use crate::process::{Scratch, assert_no_panic, run};

/// A model with two parameters, its study, and two shots without noise.
fn bench() -> Scratch {
    let folder = Scratch::new();
    folder.write(
        "m.hyd",
        "model M\n  parameter Real a = 1;\n  parameter Real k = 2;\n  Real x(start = 0, fixed = true);\nequation\n  \
         der(x) = a - k*x;\nend M;\n",
    );
    folder.write("study.toml", STUDY);
    for (name, a) in [("a.csv", 1.0), ("b.csv", 3.0)] {
        let rows = (0..=40).map(|k| 0.05 * f64::from(k));
        let rows = rows.map(|t| format!("{t:.2},{:.9}\n", a / 2.0 * (1.0 - (-2.0 * t).exp())));
        folder.write(name, format!("t,x\n{}", rows.collect::<String>()));
    }
    let set = "{\"experiments\": [{\"file\": \"a.csv\", \"shot\": 1, \"a\": 1}, {\"file\": \"b.csv\", \"shot\": 2, \"a\": 3}]}";
    folder.write("set.json", set);
    folder
}

const STUDY: &str = "file = \"m.hyd\"
[models]
default = \"M\"
[channels]
x = { variable = \"x\", noise = 1e-3 }
[conditions]
a = \"a\"
[nuisances]
k = { parameter = \"k\", relative = 0.1 }
[shots]
time = \"t\"
hold_out = [2]
time_tolerance = 0.1
";

#[test]
fn the_plain_study_is_fitted() {
    let folder = bench();
    let fitted = run(folder.path(), &["fit", "study.toml", "--bench", "set.json"]);
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    assert!(fitted.stdout.starts_with("set: misfit 0.000 times that of noise alone\n"), "{}", fitted.stdout);
}

/// What is put in place of what, and how the message begins.
const CASES: [(&str, &str, &str, &str); 21] = [
    (
        "study.toml",
        "a = \"a\"",
        "a = \"a*1e300\"",
        "line 7 of the study: shot 1: `a` becomes 1e300 by the formula `a*1e300`",
    ),
    ("study.toml", "a = \"a\"", "a = \"1e200*a\"", "line 7 of the study: shot 1: `a` becomes 1e200 by the formula"),
    ("study.toml", "a = \"a\"", "a = \"-1e101\"", "line 7 of the study: shot 1: `a` becomes -1e101 by the formula"),
    (
        "study.toml",
        "a = \"a\"",
        "a = \"a/(a - 3)\"",
        "line 7 of the study: shot 2: the formula `a/(a - 3)` cannot be evaluated",
    ),
    ("set.json", "\"a\": 3", "\"a\": 3e300", "line 7 of the study: shot 2: `a` becomes 3e300 by the formula `a`"),
    // As large as that but no nonsense by itself: nothing is left of the misfit.
    ("study.toml", "a = \"a\"", "a = \"a*1e9\"", "line 5 of the study: shot 1, channel `x`: model and measurement are"),
    // Only the shot that is held out is far away.
    ("set.json", "\"a\": 3", "\"a\": 3e12", "line 5 of the study: shot 2, channel `x`: model and measurement are"),
    (
        "study.toml",
        "noise = 1e-3",
        "noise = 1e-30",
        "line 5 of the study: shot 1, channel `x`: model and measurement are",
    ),
    ("study.toml", "noise = 1e-3", "noise = 1e300", "`study.toml`: line 5: channel `x`: `noise` is 1e300, larger than"),
    (
        "study.toml",
        "noise = 1e-3",
        "noise = 1e-3, scale = 1e-200",
        "`study.toml`: line 5: channel `x`: the scale 1e-200 is no",
    ),
    (
        "m.hyd",
        "Real k = 2",
        "Real k = 1e300",
        "line 9 of the study: `k` is 1e300 in the model, larger than any parameter",
    ),
    (
        "study.toml",
        "relative = 0.1",
        "absolute = 1e200",
        "`study.toml`: line 9: nuisance `k`: `absolute` is 1e200, larger than",
    ),
    ("a.csv", "0.05,", "0.05,1e300\n0.051,", "`a.csv`: line 3, column `x`: 1e300 is not a measured value"),
    ("a.csv", "0.05,", "1e120,", "`a.csv`: line 3, column `t`: 1e120 is not a measured value"),
    ("study.toml", "[shots]", "[shots]\ntime_scale = 1e100", "`a.csv`: line 23: 1.05e100 s is not a time"),
    (
        "study.toml",
        "hold_out = [2]",
        "hold_out = [7]",
        "line 12 of the study: `hold_out` names shot 7, which the set does not have",
    ),
    (
        "study.toml",
        "default = \"M\"",
        "default = \"M; end M; model X\"",
        "`study.toml`: line 3: `M; end M; model X` is not the name of a class",
    ),
    (
        "study.toml",
        "variable = \"x\"",
        "variable = \"x; Real z = 1\"",
        "the model `M` of the study `study.toml` cannot be translated\nerror[E0101]: ",
    ),
    (
        "study.toml",
        "variable = \"x\"",
        "variable = \"x > 1\"",
        "the model `M` of the study `study.toml` cannot be translated\nerror[E0204]: the value of the channel is Boolean, but the channel is Real",
    ),
    (
        "study.toml",
        "variable = \"x\"",
        "variable = \"hyd_channel_0\"",
        "the model `M` of the study `study.toml` cannot be translated\nerror[E0201]: unknown name `hyd_channel_0` in `M`\n = in the channel",
    ),
    (
        "study.toml",
        "k = {",
        "offset = 1.0\nk = {",
        "`study.toml`: line 9: invalid type: floating point `1.0`, expected the name of a parameter",
    ),
];

#[test]
fn numbers_that_make_no_sense_end_with_their_line() {
    for (file, from, to, message) in CASES {
        let folder = bench();
        let text = folder.read(file);
        assert!(text.contains(from), "{from}");
        folder.write(file, text.replacen(from, to, 1));
        for verb in [&["fit"][..], &["discover", "--report", "report"]] {
            let outcome = run(folder.path(), &[verb, &["study.toml", "--bench", "set.json"]].concat());
            assert_no_panic(&outcome);
            assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(1), ""), "{to}: {}", outcome.stderr);
            assert!(outcome.stderr.starts_with(&format!("error: {message}")), "{to}: {}", outcome.stderr);
        }
    }
}

#[test]
fn masks_that_leave_out_nothing_are_told() {
    let folder = bench();
    let said = |masks: &str| {
        folder.write("other.toml", format!("{STUDY}{masks}"));
        let outcome = run(folder.path(), &["fit", "other.toml", "--bench", "set.json"]);
        (outcome.code, outcome.stderr)
    };
    assert_eq!(said("masks = [{ from = 1.0 }, { around = [\"a/3\"], within = 0.01 }]\n"), (Some(0), String::new()));
    let masks = "[[shots.masks]]\nfrom = 1.5\n[[shots.masks]]\nfrom = 5.0\n[[shots.masks]]\naround = [\"1e200\"]\nwithin = 0.1\n";
    let said = said(masks);
    let warning = |line| format!("warning: line {line} of the study: the mask leaves out no sample of any shot\n");
    assert_eq!(said, (Some(0), warning(16) + &warning(18)));
}

/// What a message would not tell apart is refused, or said.
#[test]
fn names_of_studies_are_told_apart() {
    let folder = bench();
    let said = |study: String, set: &str| {
        folder.write("other.toml", study);
        folder.write("other.json", set);
        let outcome = run(folder.path(), &["fit", "other.toml", "--bench", "other.json"]);
        (outcome.code, outcome.stderr)
    };
    let set = folder.read("set.json");
    let same = set.replace("\"shot\": 2", "\"shot\": 1");
    let warning =
        "warning: `other.json`: the shots 1 and 2 of the list both have the number 1: reports do not tell them apart\n";
    let refused = "error: line 12 of the study: `hold_out` names shot 1, and several shots have this number\n";
    assert_eq!(said(STUDY.replace("[2]", "[1]"), &same), (Some(1), format!("{warning}{refused}")));
    assert_eq!(said(STUDY.replace("hold_out = [2]\n", ""), &same), (Some(0), warning.to_string()));
    let named = STUDY.replace("noise = 1e-3", "noise = 1e-3, gain = 0.01").replace("k = {", "\"gain of x\" = {");
    let sentence = "the name `gain of x` is that of a number which is fitted anyway; call the nuisance otherwise";
    assert_eq!(said(named, &set), (Some(1), format!("error: line 9 of the study: {sentence}\n")));
}
