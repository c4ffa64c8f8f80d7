//! Studies: what a fit says, and what is said where study, model and effects do not fit together.

use crate::process::{Scratch, run};

/// The folder of a new project with the tables of its two shots.
fn project() -> Scratch {
    let folder = Scratch::new();
    assert_eq!(run(folder.path(), &["new", "drv"]).code, Some(0));
    let own = folder.path().join("drv");
    for (p0, table) in [("p0=10e6", "bench/shot1.csv"), ("p0=14e6", "bench/shot2.csv")] {
        let shot = ["simulate", "drive.hyd", "--set", p0, "--variables", "^(y|p)$", "--result", table];
        assert_eq!(run(&own, &shot).code, Some(0));
    }
    folder
}

/// Writes a study that is the project's but for one thing.
fn study(folder: &Scratch, from: &str, to: &str) {
    let text = folder.read("drv/bench.toml");
    assert!(text.contains(from), "{text}");
    folder.write("drv/other.toml", text.replace(from, to));
}

const FIT: [&str; 4] = ["fit", "other.toml", "--bench", "bench/set.json"];

#[test]
fn without_shots_held_out_there_is_no_gap_on_them() {
    let folder = project();
    study(&folder, "[shots]", "[shots]\nhold_out = []");
    let fitted = run(&folder.path().join("drv"), &FIT);
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    assert!(fitted.stdout.contains("gap (1.00 is noise)        fitted\n"), "{}", fitted.stdout);
    assert!(!fitted.stdout.contains("NaN") && !fitted.stdout.contains("held out"), "{}", fitted.stdout);
    let json = run(&folder.path().join("drv"), &[&FIT[..], &["--json"]].concat()).stdout;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json["gap"]["heldout"].is_null() && json["gap"]["train"]["all"].is_number(), "{json}");
}

/// The parameters that a fit writes make the run that it has fitted: the study's table is such a run.
#[test]
fn what_a_fit_has_found_can_be_run() {
    let folder = project();
    let own = folder.path().join("drv");
    study(&folder, "k = \"spring.k\"", "k = \"spring.k\"");
    let fitted = run(&own, &[&FIT[..], &["--write-parameters", "fitted.toml"]].concat());
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    assert!(fitted.stdout.contains("spring.k = ") && fitted.stdout.contains(" N/m (expected "), "{}", fitted.stdout);
    let text = folder.read("drv/fitted.toml");
    assert!(text.contains("under the conditions of shot ") && text.contains("\"spring.k\" = "), "{text}");
    let simulated = run(
        &own,
        &["simulate", "drive.hyd", "--parameters", "fitted.toml", "--variables", "^(y|p)$", "--result", "again.csv"],
    );
    assert_eq!(simulated.code, Some(0), "{}", simulated.stderr);
    let table = if text.contains("conditions of shot 1,") { "bench/shot1.csv" } else { "bench/shot2.csv" };
    let compared = run(&own, &["compare", table, "again.csv", "--tolerance", "2e-2"]);
    assert_eq!(compared.code, Some(0), "{}{}", compared.stdout, compared.stderr);
    // The model's own file is not written over.
    let over = run(&own, &[&FIT[..], &["--write-parameters", "other.toml"]].concat());
    assert!(over.code != Some(0) && over.stderr.contains("other.toml"), "{}", over.stderr);
}

/// The text that is translated is made of the study; messages are about what the user has written.
/// Where the model does not run beyond what a fit has reached, the values are no minimum, and the reason is said.
#[test]
fn a_fit_that_the_model_stops_says_so() {
    let folder = project();
    let own = folder.path().join("drv");
    for (p0, table) in [("p0=10e6", "bench/shot1.csv"), ("p0=14e6", "bench/shot2.csv")] {
        let shot = [
            "simulate",
            "drive.hyd",
            "--set",
            p0,
            "--set",
            "spring.k=26500",
            "--variables",
            "^(y|p)$",
            "--result",
            table,
        ];
        assert_eq!(run(&own, &shot).code, Some(0));
    }
    let text = folder.read("drv/drive.hyd");
    let held = text.replace("equation\n", "equation\n  assert(spring.k < 25.5e3, \"the spring is too stiff\");\n");
    folder.write("drv/drive.hyd", held);
    study(&folder, "k = \"spring.k\"", "k = \"spring.k\"");
    let fitted = run(&own, &FIT);
    assert_eq!(fitted.code, Some(3), "{}", fitted.stderr);
    assert!(fitted.stdout.contains("spring.k = 25"), "{}", fitted.stdout);
    assert!(fitted.stdout.contains("steps, stopped where the model does not run further"), "{}", fitted.stdout);
    assert!(fitted.stderr.contains("beyond its values") && fitted.stderr.contains("too stiff"), "{}", fitted.stderr);
    // The same without the assertion is a minimum.
    folder.write("drv/drive.hyd", text);
    let fitted = run(&own, &FIT);
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    assert!(fitted.stdout.contains("spring.k = 26"), "{}", fitted.stdout);
}

/// The report of a fit has the values of its JSON, the curves of every shot and channel, and takes the place of no input.
#[test]
fn a_fit_writes_a_report() {
    let folder = project();
    let own = folder.path().join("drv");
    study(&folder, "k = \"spring.k\"", "k = \"spring.k\"");
    let fitted = run(&own, &[&FIT[..], &["--report", "report", "--profile", "k", "--json"]].concat());
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    let printed: serde_json::Value = serde_json::from_str(&fitted.stdout).unwrap();
    let written: serde_json::Value = serde_json::from_str(&folder.read("drv/report/fit.json")).unwrap();
    assert_eq!(printed["unknowns"], written["unknowns"]);
    let spring = printed["unknowns"].as_array().unwrap().iter().find(|own| own["name"] == "k").unwrap();
    let figure = |value: &serde_json::Value| value.as_f64().unwrap();
    let (units, profile) = (&spring["in_units"], &printed["profiles"][0]);
    assert_eq!((units["parameter"].as_str(), units["unit"].as_str()), (Some("spring.k"), Some("N/m")));
    assert_eq!(spring["interval"][0], profile["low"]);
    let share = figure(&units["interval"][1]) / figure(&units["expected"]);
    assert!((share - figure(&profile["high"])).abs() < 1e-9, "{spring:#} {profile:#}");
    // The model as stated leaves no less than the fitted one.
    let gap = &written["report"]["gap"]["train"];
    assert!(figure(&gap["before"]) >= 0.999 * figure(&gap["after"]), "{gap:#}");
    let table = folder.read("drv/report/fit.csv");
    assert!(table.starts_with("shot,channel,time_s,measured,stated,fitted,mask\n"), "{table}");
    let (page, picture) = (folder.read("drv/report/fit.html"), folder.read("drv/report/fit.svg"));
    for name in ["y, shot 1", "p, shot 2", "as stated", "as fitted"] {
        assert!(picture.contains(name), "{name}");
    }
    assert!(page.contains("\"in_units\"") && page.contains("model as fitted") && !page.contains("/*DATA*/null"));
    assert!(folder.read("drv/report/fit.toml").contains("\"spring.k\" = "));
    // A table of the bench is not written over, and nothing is left behind.
    std::fs::create_dir(own.join("r")).unwrap();
    let set = folder.read("drv/bench/set.json").replace("shot1.csv", "fit.csv");
    folder.write("drv/r/set.json", set.replace("shot2.csv", "../bench/shot2.csv"));
    folder.write("drv/r/fit.csv", folder.read("drv/bench/shot1.csv"));
    let refused = run(&own, &["fit", "other.toml", "--bench", "r/set.json", "--allow-outside", "--report", "r"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("fit.csv"), "{}", refused.stderr);
    assert!(!own.join("r/fit.html").exists());
}

#[test]
fn what_a_study_names_wrongly_is_said_of_the_study() {
    let folder = project();
    let own = folder.path().join("drv");
    let cases = [
        (
            "variable = \"y\"",
            "variable = \"yy*2\"",
            "error: the model `Drv` of the study `other.toml` cannot be translated\n\
             error[E0201]: unknown name `yy` in `Drv`\n = did you mean `y`?\n = in the channel `yy*2` of the study `other.toml`\n",
        ),
        (
            "default = \"Drv\"",
            "default = \"Drvv\"",
            "error: the model `Drvv` of the study `other.toml` cannot be translated\n\
             error[E0202]: there is no class `Drvv` here\n = did you mean `Drv`?\n = in the model `Drvv` of the study `other.toml`\n",
        ),
        (
            "k = \"spring.k\"",
            "k = \"sprin.k\"",
            "error: `k` in `[nuisances]` of the study: the model has no parameter `sprin.k`; did you mean `spring.k`?\n",
        ),
        (
            "p0 = \"p0_Pa\"",
            "p00 = \"p0_Pa\"",
            "error: `[conditions]` of the study: the model has no parameter `p00`; did you mean `p0`?\n",
        ),
    ];
    for (from, to, message) in cases {
        study(&folder, from, to);
        let outcome = run(&own, &FIT);
        assert_eq!((outcome.code, outcome.stderr.trim_end()), (Some(1), message.trim_end()));
    }
}

/// Marks in the model's own file stay, under the name of that file, also where its last line is missing.
#[test]
fn faults_of_the_model_are_shown_in_its_file() {
    let folder = project();
    let own = folder.path().join("drv");
    let text = folder.read("drv/drive.hyd");
    let cut = text.rsplit_once("end Drv;").unwrap().0;
    let asserting = text.replace("equation\n", "equation\n  assert(valve.s < 1e-3, \"too far\");\n");
    let cases = [
        (
            text.replacen("Units.Time t_on", "Units.Tim t_on", 1),
            1,
            "error[E0202]: `Hyd.Units` has no class `Tim`",
            ":7:19",
        ),
        (cut.to_string(), 1, "error[E0101]: `end Drv;` is missing at the end of the file", ":1:7"),
        (asserting, 3, "too far", ":31"),
    ];
    study(&folder, "drive.hyd", "broken.hyd");
    for (text, code, message, place) in cases {
        folder.write("drv/broken.hyd", text);
        let discover = ["discover", "other.toml", "--bench", "bench/set.json", "--report", "report"];
        for arguments in [&FIT[..], &discover] {
            let outcome = run(&own, arguments);
            assert_eq!(outcome.code, Some(code), "{}", outcome.stderr);
            let said = outcome.stderr.replace("./", "");
            assert!(said.contains(message) && said.contains(&format!("broken.hyd{place}")), "{said}");
            assert!(!said.contains("HydPlaces") && !said.contains("Discovered") && !said.contains("study:"), "{said}");
        }
    }
}

#[test]
fn effects_that_do_not_fit_are_named_with_their_places() {
    let folder = project();
    let own = folder.path().join("drv");
    let note = "annotation(__hyd(effect(id = \"seep\", kind = \"physics\", at = {\"leakage\"}, adds = cc, probe = 1e-11, \
                prior = \"lognormal(1e-11, 0.7)\")));";
    let cases = [
        (
            "  parameter Real cc = 1;\n",
            "error: the model `Drv` with the effect `Seep` in `leakage` of the study `bench.toml` cannot be translated\n\
             error[E0210]: `Seep` has no element `port_a`, which `Hyd.Places.PartialLeakage` has\n",
            "in the model `Drv` with the effect `Seep` in `leakage`",
        ),
        (
            "  extends Hyd.Places.PartialLeakage;\n  parameter Real c = 1e-11;\nequation\n  q = c*dp;\n",
            "error: effect `seep` (",
            "Seep.hyd:1) in `leakage`: the model has no parameter `leakage.cc`; did you mean `leakage.c`?",
        ),
    ];
    std::fs::create_dir(own.join("library")).unwrap();
    for (inside, begin, part) in cases {
        folder.write("drv/library/Seep.hyd", format!("model Seep\n{inside}  {note}\nend Seep;\n"));
        let arguments =
            ["discover", "bench.toml", "--bench", "bench/set.json", "--report", "report", "--library", "library"];
        let outcome = run(&own, &arguments);
        assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
        assert!(outcome.stderr.starts_with(begin) && outcome.stderr.contains(part), "{}", outcome.stderr);
        assert!(!outcome.stderr.contains("Discovered"), "{}", outcome.stderr);
    }
}

/// A model without places takes laws at its equations; an effect that does not say that it is one is named with what to write.
#[test]
fn effects_that_should_be_laws_are_named() {
    let folder = Scratch::new();
    folder.write(
        "coil.hyd",
        "model Coil\n  parameter Real R(unit = \"Ohm\") = 2;\n  parameter Real L(unit = \"H\") = 0.1;\n  input Real u(unit = \"V\");\n  \
         Real i(unit = \"A\", start = 0, fixed = true);\nequation\n  L*der(i) = u - R*i;\nend Coil;\n",
    );
    folder.write(
        "study.toml",
        "file = \"coil.hyd\"\n[models]\ndefault = \"Coil\"\n[channels]\ni_A = { variable = \"i\", unit = \"A\", noise = 0.01 }\n\
         [inputs]\nu = { column = \"volt\", unit = \"V\" }\n[nuisances]\nR = { parameter = \"R\", relative = 0.05 }\n[shots]\ntime = \"t\"\n",
    );
    for (name, height) in [("a.csv", 4.0), ("b.csv", 6.0), ("c.csv", 8.0)] {
        let mut table = "t,volt,i_A\n".to_string();
        for k in 0..200_i32 {
            let t = 1e-3 * f64::from(k);
            // A sawtooth stands in for noise.
            let noise = 0.017 * (f64::from((k * 7919) % 101) / 50.0 - 1.0);
            table += &format!("{t},{height},{}\n", height / 2.0 * (1.0 - (-20.0 * t).exp()) + noise);
        }
        folder.write(name, table);
    }
    folder
        .write("set.json", "{\"experiments\": [{\"file\": \"a.csv\"}, {\"file\": \"b.csv\"}, {\"file\": \"c.csv\"}]}");
    std::fs::create_dir(folder.path().join("library")).unwrap();
    let law = |says: &str| {
        format!(
            "block Drop\n  extends Hyd.Places.VoltageLaw;\n  parameter Real U_d(min = 0) = 0.5;\nequation\n  u = -U_d*tanh(i/1e-3);\n  \
             annotation(__hyd(effect(id = \"drop\", kind = \"physics\", {says}at = {{\"voltage\"}}, adds = U_d, zero = 0, probe = 0.3, \
             prior = \"lognormal(0.5, 0.8)\")));\nend Drop;\n"
        )
    };
    let discover = ["discover", "study.toml", "--bench", "set.json", "--report", "report", "--library", "library"];
    let said = "warning: `Drop` (library/Drop.hyd:1) is not tried: the place `voltage` of this model takes laws; write `law = true` in its annotation";
    for (says, is_said) in [("", true), ("law = true, ", false)] {
        folder.write("library/Drop.hyd", law(says));
        let outcome = run(folder.path(), &discover);
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        assert_eq!(outcome.stderr.contains(said), is_said, "{}", outcome.stderr);
        assert_eq!(folder.read("report/report.json").contains("\"drop\""), !is_said);
    }
}

/// Shots in which a loop becomes a recurrence that grows are run with the loop whole: far from its ends the chain of `late.hyd` has
/// `x = u*(a + 1)/a`.  What the sensor shows is 1.05 times that, and noise is none.
#[test]
fn a_fit_runs_again_what_rounding_spoils() {
    let folder = Scratch::new();
    let text = hyd_tests::models::text_of("tests/cases/networks/late.hyd");
    let sensor = "parameter Real large = 1000;\n  parameter Real factor = 1;\n  Real y = factor*x[31];\n  parameter Integer n = 60;";
    folder.write("late.hyd", text.replace("parameter Integer n = 60;", sensor).replace("then 1000", "then large"));
    let study = "file = \"late.hyd\"\n[models]\ndefault = \"Late\"\n[channels]\ny = { variable = \"y\", noise = 1e-4 }\n\
                 [conditions]\nlarge = \"large\"\n[nuisances]\nfactor = { parameter = \"factor\", relative = 0.1 }\n\
                 [shots]\ntime = \"t\"\ntime_tolerance = 0.1\nhold_out = []\nmasks = [{ to = 0.5 }]\n";
    folder.write("study.toml", study);
    for (name, large) in [("a.csv", 1000.0), ("b.csv", 400.0)] {
        let mut table = "t,y\n".to_string();
        for t in (0..=100).map(|k| 0.01 * f64::from(k)) {
            table += &format!("{t},{:.12}\n", 1.05 * (-t).exp() * (large + 1.0) / large);
        }
        folder.write(name, table);
    }
    let set = "{\"experiments\": [{\"file\": \"a.csv\", \"large\": 1000}, {\"file\": \"b.csv\", \"large\": 400}]}";
    folder.write("set.json", set);
    let fitted = run(folder.path(), &["fit", "study.toml", "--bench", "set.json", "--json"]);
    assert_eq!(fitted.code, Some(0), "{}", fitted.stderr);
    let said = "warning: a loop of equations could not be solved one variable after the other in ";
    assert!(fitted.stderr.starts_with(said) && fitted.stderr.lines().count() == 1, "{}", fitted.stderr);
    let report: serde_json::Value = serde_json::from_str(&fitted.stdout).unwrap();
    assert!(report["whole_loops"].as_u64().is_some_and(|runs| runs >= 2), "{report}");
    let factor = report["unknowns"][0]["value"].as_f64().unwrap();
    assert!((factor - 1.05).abs() < 1e-5 && report["unknowns"][0]["name"] == "factor", "{report}");
    let discovered = ["discover", "study.toml", "--bench", "set.json", "--report", "report"];
    let found = run(folder.path(), &discovered);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    assert!(found.stderr.matches(said).count() == 1 && found.stdout.starts_with("adequate"), "{found:?}");
}

/// Two effects of one id would be an answer that nobody understands; of two places of one id effects take the first, which is said.
#[test]
fn effects_and_places_of_one_name_are_told() {
    let folder = project();
    let own = folder.path().join("drv");
    let note = "annotation(__hyd(effect(id = \"chamber_leakage\", kind = \"physics\", at = {\"leakage\"}, adds = c, probe = 1e-11, \
                prior = \"lognormal(1e-11, 0.7)\")));";
    let inside = "extends Hyd.Places.PartialLeakage;\n  parameter Real c = 1e-11;\nequation\n  q = c*dp;\n";
    std::fs::create_dir(own.join("library")).unwrap();
    folder.write("drv/library/Seep.hyd", format!("model Seep\n  {inside}  {note}\nend Seep;\n"));
    let arguments =
        ["discover", "other.toml", "--bench", "bench/set.json", "--report", "report", "--library", "library"];
    study(&folder, "file = ", "file = ");
    let outcome = run(&own, &arguments);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let sentence = "are both called `chamber_leakage` and go by the names of their classes; give one another id, or name one in \
                    `without` of the study\n";
    assert!(
        outcome.stderr.starts_with("warning: the effects `") && outcome.stderr.ends_with(sentence),
        "{}",
        outcome.stderr
    );
    assert!(outcome.stderr.contains("`Seep`") && outcome.stderr.contains("`Hyd.Effects.ChamberLeakage`"));
    let report: serde_json::Value = serde_json::from_str(&folder.read("drv/report/report.json")).unwrap();
    let tried = |name: &str| {
        let all = report["candidates"].as_array().unwrap();
        all.iter().any(|own| own["id"] == name && own["effect"] == name)
    };
    assert!(tried("Seep") && tried("Hyd.Effects.ChamberLeakage") && !tried("chamber_leakage"), "{report:#}");
    study(&folder, "file = ", "without = [\"Hyd.Effects\", \"seep\"]\nfile = ");
    let outcome = run(&own, &arguments);
    let warning = "warning: line 3 of the study: `without` names `seep`, which is not an effect or a package of effects; did you mean `Seep`?\n";
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), warning));
    study(&folder, "file = ", "without = [\"Hyd.Effects\"]\nfile = ");
    let drive = folder.read("drv/drive.hyd");
    let second = "  replaceable Hyd.Places.NoLeakage other constrainedby Hyd.Places.PartialLeakage \
                  annotation(__hyd(place(id = \"leakage\")));\n  Signals.Sources.SmoothStep opens";
    let twice = drive.replacen("  Signals.Sources.SmoothStep opens", second, 1);
    let twice = twice.replace(
        "  // motion\n",
        "  connect(cylinder.port, other.port_a);\n  connect(other.port_b, tank.port);\n  // motion\n",
    );
    assert!(twice.len() > drive.len() + second.len(), "both are put in");
    folder.write("drv/drive.hyd", twice);
    let outcome = run(&own, &arguments);
    let warning = "warning: `leakage` and `other` are both the place `leakage`; effects are tried in `leakage` only\n";
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), warning));
}

/// A law with the fourth power of a temperature means nothing in degrees Celsius.
#[test]
fn radiation_of_what_is_not_absolute_is_not_tried() {
    let folder = Scratch::new();
    folder.write(
        "m.hyd",
        "model Body\n  parameter Real C = 50;\n  parameter Real G = 1;\n  Real T[2](each start = 80, each fixed = true);\nequation\n  for i in 1:2 loop\n    \
         C*der(T[i]) = -G*(T[i] - 20);\n  end for;\nend Body;\n",
    );
    folder.write(
        "study.toml",
        "file = \"m.hyd\"\n[models]\ndefault = \"Body\"\n[channels]\nT = { variable = \"T[1]\", noise = 0.1 }\n\
         [nuisances]\nG = { parameter = \"G\", relative = 0.05 }\n[shots]\ntime = \"t\"\n",
    );
    for name in ["a.csv", "b.csv", "c.csv"] {
        let rows = (0..200_i32).map(|k| {
            let noise = 0.17 * (f64::from((k * 7919) % 101) / 50.0 - 1.0);
            format!("{},{}\n", f64::from(k), 20.0 + 60.0 * (-f64::from(k) / 50.0).exp() + noise)
        });
        folder.write(name, format!("t,T\n{}", rows.collect::<String>()));
    }
    folder
        .write("set.json", "{\"experiments\": [{\"file\": \"a.csv\"}, {\"file\": \"b.csv\"}, {\"file\": \"c.csv\"}]}");
    let outcome = run(folder.path(), &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let said: Vec<&str> = outcome.stderr.lines().filter(|line| line.contains("radiation")).collect();
    assert!(said.len() == 1 && said[0].contains("this law needs an absolute temperature in K"), "{said:?}");
}

/// Effects of the machine have places at balances; a formula of the time has none, and the effects of the channels are searched all the same.
#[test]
fn a_model_without_a_balance_is_said_to_be_one() {
    let folder = Scratch::new();
    folder.write("m.hyd", "model Formula\n  parameter Real a = 2;\n  Real y = a*time;\nend Formula;\n");
    folder.write(
        "study.toml",
        "file = \"m.hyd\"\n[models]\ndefault = \"Formula\"\n[channels]\ny = { variable = \"y\", noise = 0.01 }\n\
         [nuisances]\na = { parameter = \"a\", relative = 0.05 }\n[shots]\ntime = \"t\"\n",
    );
    for name in ["a.csv", "b.csv", "c.csv"] {
        let rows = (0..200_i32).map(|k| {
            let noise = 0.017 * (f64::from((k * 7919) % 101) / 50.0 - 1.0);
            format!("{},{}\n", 1e-2 * f64::from(k), 2e-2 * f64::from(k) + noise)
        });
        folder.write(name, format!("t,y\n{}", rows.collect::<String>()));
    }
    folder
        .write("set.json", "{\"experiments\": [{\"file\": \"a.csv\"}, {\"file\": \"b.csv\"}, {\"file\": \"c.csv\"}]}");
    let outcome = run(folder.path(), &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let said = "no balance of forces, voltages, currents, heat or flow was found in the equations of `Formula`";
    assert!(outcome.stderr.contains(said), "{}", outcome.stderr);
    assert!(outcome.stdout.starts_with("adequate"), "{}", outcome.stdout);
}

/// What `hyd check` warns of is said where the model is fitted, too, at its line, and no more.
#[test]
fn warnings_of_the_model_are_said() {
    let folder = project();
    let own = folder.path().join("drv");
    let text = folder.read("drv/drive.hyd");
    let parts = "  Hyd.Translational.Components.Spring idle(k = 1);\n  Hyd.Translational.Components.Fixed wall;\n";
    let idle = text.replacen("equation\n", &format!("{parts}equation\n  connect(wall.flange, idle.flange_a);\n"), 1);
    let line = idle.lines().position(|line| line.contains(" idle(")).unwrap() + 1;
    folder.write("drv/warned.hyd", idle);
    study(&folder, "drive.hyd", "warned.hyd");
    let fitted = run(&own, &FIT);
    assert_eq!(fitted.code, Some(0), "{}", fitted.stderr);
    let said = format!("warned.hyd`, line {line}: nothing is connected to");
    assert!(fitted.stderr.contains(&said), "{}", fitted.stderr);
    assert_eq!(fitted.stderr.matches("warning").count(), fitted.stderr.lines().count(), "{}", fitted.stderr);
}
