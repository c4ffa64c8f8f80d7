//! Recorded sets of another simulator against the drive with what each of them hides, at the values that were drawn.
//!
//! Nothing is fitted: effect, parameters, offsets and gains are those of `tests/data/bench/answers.json`, the model is
//! the library's. What is left over in each channel must then be noise and rounding; without the effect it must be
//! more, or the set would show nothing.  The noise stated by a set leaves out the rounding, which adds up to 2 % here.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile};
use hyd_discovery::{Bench, Nuisance, Shot, Study};
use hyd_results::{Side, Trajectory};
use hyd_runtime::simulate;
use hyd_system::{DaeSystem, Place};
use hyd_tests::models::{messages, root, text_of};
use hyd_tests::runs::{instance, on_grid};
use serde_json::Value;

/// Set, base model, modification that puts in what the set hides.
const SETS: [(&str, &str, &str); 10] = [
    ("B01", "Drive", ""),
    ("B02", "Drive", "redeclare Hyd.Effects.SupplyLine supply(l = 1.2, d = 14e-3, a = 1250, V_g = 0.3e-3, nu = 4e-4)"),
    ("B03", "Drive", "hy(redeclare Hyd.Effects.ChamberLeakage leakage(k_leak = 1.2e-11))"),
    ("B04", "Drive", "sh(redeclare Hyd.Effects.PistonFriction force(F_c = 70, ratio = 110/70, v_s = 0.05))"),
    ("B05", "Drive", "ro(redeclare Hyd.Effects.EddyCurrents magnetics(g_e = 1/18))"),
    ("B06", "Drive", "ro(rlc(redeclare Hyd.Effects.TriggerDelay trigger(t_d = 0.35e-3)))"),
    ("B07", "Drive", "hy(ra(redeclare Hyd.Effects.EntrainedAir contents(alpha = 0.08, n = 1.4)))"),
    ("B08", "DriveConstantInductance", "ro(redeclare Hyd.Effects.VariableInductance lc(kappa = 1))"),
    (
        "B09",
        "Drive",
        "redeclare Hyd.Effects.SupplyLine supply(l = 1.8, d = 16e-3, a = 1250, V_g = 0.3e-3, nu = 4e-4), \
         sh(redeclare Hyd.Effects.PistonFriction force(F_c = 55, ratio = 80/55, v_s = 0.05))",
    ),
    ("B10", "Drive", "redeclare BackPressure drain(k_d = 5.5e12)"),
];

/// What set B10 hides is in no library, so it is written here as a user would write it.
const BACK_PRESSURE: &str = "model BackPressure\n  extends Hyd.Places.PartialDrain;\n  parameter Real k_d(unit = \"Pa.s2/m6\") = 1e12;\n\
    equation\n  port.p = p_z + k_d*port.q*noEvent(abs(port.q));\nend BackPressure;\n";

fn translated(base: &str, modification: &str) -> Compilation {
    let text = format!(
        "within SingleActingDrive;\nmodel Truth\n  {BACK_PRESSURE}  extends {base}({modification});\nend Truth;\n"
    );
    let mut library = LibraryPath::new();
    library.add_main_file(&root().join("models/single_acting_drive/truth.hyd"), &text);
    let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut library, "truth.hyd", &text, &options);
    assert!(!compilation.has_errors() && compilation.model.is_some(), "{text}\n{}", messages(&compilation));
    compilation
}

/// The drawn value of every parameter: nominal values, those that the shot decides, times what was drawn.
fn parameters(system: &dyn DaeSystem, study: &Study, shot: &Shot, before: f64, drawn: &Value) -> Vec<(String, String)> {
    let mut set = BTreeMap::new();
    let [p0, u0, c, pulse] = ["p0_Pa", "U0_V", "C_F", "pulse_s"].map(|key| shot.conditions[key]);
    // A record starts at zero.
    for (name, value) in [("p0", p0), ("U0", u0), ("C", c), ("t_on", before), ("t_off", before + pulse)] {
        set.insert(name.to_string(), value);
    }
    for (key, factor) in drawn.as_object().expect("multipliers") {
        let Nuisance::Parameter(name) = &study.nuisances[key] else { panic!("`{key}` is stated at length") };
        // With the pump off there is no supply pressure to be off.
        if name == "p0" && p0 < 1.1e5 {
            continue;
        }
        let value = set.entry(name.clone()).or_insert_with(|| {
            let (info, element) = system.tables().find(name).unwrap_or_else(|| panic!("no parameter `{name}`"));
            let Place::Parameter(index) = info.sources[element].place else { panic!("`{name}` is not a parameter") };
            system.parameters()[index as usize]
        });
        *value *= factor.as_f64().expect("a number");
    }
    set.into_iter().map(|(name, value)| (name, format!("{value:e}"))).collect()
}

/// Residual over noise by channel, over all shots of a set.
fn misfits(study: &Study, bench: &Bench, answer: &Value, model: &Compilation) -> BTreeMap<String, f64> {
    let before = bench.pre_trigger.expect("stated");
    let tolerance = if model.model.as_ref().is_some_and(|model| !model.instantiate().structure().delays.is_empty()) {
        1e-6
    } else {
        1e-8
    };
    let mut nominal = instance(model, &[]);
    nominal.bind(0.0).expect("the nominal values are sound");
    let mut sums: BTreeMap<String, (f64, usize)> = BTreeMap::new();
    for shot in &bench.shots {
        let set = parameters(&nominal, study, shot, before, &answer["multipliers"]);
        let set: Vec<(&str, &str)> = set.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let mut system = instance(model, &set);
        let mut rows = Trajectory::new();
        let stop = before + shot.times.last().expect("samples");
        let options = hyd_runtime::Options { event_rows: true, ..on_grid(stop, shot.times.len() - 1, tolerance) };
        let end = simulate(&mut system, &options, &mut rows, &|| false);
        end.unwrap_or_else(|error| panic!("{}, shot {}: {error}", bench.name, shot.number));
        for (channel, measured) in &shot.values {
            let series = rows.series(&study.channels[channel].variable).expect("a channel");
            let number = |key: &str| answer[key][channel].as_f64().expect("drawn");
            let (gain, offset, noise) = (number("gains"), number("offsets"), bench.noise[channel]);
            let (sum, count) = sums.entry(channel.clone()).or_default();
            for (t, value) in shot.times.iter().zip(measured) {
                let residual = value - gain * series.value(before + t, Side::After) - offset;
                *sum += (residual / noise).powi(2);
                *count += 1;
            }
        }
    }
    sums.into_iter().map(|(channel, (sum, count))| (channel, (sum / count as f64).sqrt())).collect()
}

#[test]
fn what_each_set_hides_brings_every_channel_to_noise() {
    let folder = root().join("tests/data/bench");
    let study = Study::parse(&text_of("models/single_acting_drive/bench.toml")).expect("a study");
    let answers: Value = serde_json::from_str(&text_of("tests/data/bench/answers.json")).expect("JSON");
    let mut above = String::new();
    for (name, base, modification) in SETS {
        let mut read = |file: &str| Ok(fs::read_to_string(folder.join(file)).expect("readable"));
        let text = text_of(&format!("tests/data/bench/{name}.json"));
        let bench = Bench::parse(Path::new(name), &text, &study, &mut read).expect("a set");
        let with = misfits(&study, &bench, &answers[name], &translated(base, modification));
        println!("{name}: {with:.3?}");
        for (channel, misfit) in &with {
            if !(0.95..1.05).contains(misfit) {
                above += &format!("{name}: {channel} is left with {misfit:.3} of its noise\n");
            }
        }
        if !modification.is_empty() {
            let without = misfits(&study, &bench, &answers[name], &translated(base, ""));
            let largest = without.values().copied().fold(0.0, f64::max);
            assert!(largest > 1.5, "{name} shows nothing: {without:?}");
        }
    }
    assert!(above.is_empty(), "{above}");
}
