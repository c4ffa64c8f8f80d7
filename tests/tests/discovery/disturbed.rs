//! Sets of the drive with nothing missing that are disturbed as laboratories disturb theirs: no effect may be named, and what disturbs
//! them must be said.

use std::fs;

use super::{folder, hyd, json, study, thinned};
use crate::plain::{Bench, SWING, answer, check_names};

/// What is said of a set of which one sample of `every` is kept, and how much what is left exceeds the noise as stated.
fn said(set: &str, every: usize) -> (String, f64) {
    let folder = folder(&format!("disturbed_{set}"));
    let bench = thinned(&folder, &format!("disturbed/{set}"), every);
    let found = hyd(&folder, &["discover", &study(), "--bench", &bench, "--report", "."]);
    let is_expected = |line: &str| line.ends_with("of the study stands in no table and is left out");
    assert!(found.code == Some(0) && found.stderr.lines().all(is_expected), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report.json")).expect("written"));
    assert_eq!(report["status"], "adequate", "{}", found.stdout);
    (found.stdout, report["gap"]["heldout"]["before"].as_f64().expect("a number"))
}

/// Spikes before the trigger hide that noise is correlated, and noise that is correlated over two samples is noise; so all samples are
/// needed.
#[test]
fn correlated_noise_with_heavy_tails_is_noise() {
    let (said, left) = said("tails", 1);
    for channel in ["i_A", "x_m", "y_m", "pR_Pa", "p0_Pa"] {
        assert!(said.contains(&format!("noise of {channel} is 1.4 times what was stated")), "{said}");
    }
    assert!(said.contains("left out as spikes: ") && left > 1.3, "{said}");
}

/// A coil that is warmer in every shot by another amount explains what resistances that scatter do.
#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn resistances_that_scatter_are_not_a_coil_that_heats_up() {
    let (said, left) = said("scatter", 2);
    assert!(said.contains("R scatters from shot to shot by about") && left < 1.1, "{said}");
}

/// Two fitted shots show that a resistance scatters; a coil that is warmer in each by another amount would explain it, too.
#[test]
fn two_shots_are_enough_to_scatter() {
    let (said, left) = said("few", 4);
    assert!(said.contains("R scatters from shot to shot by about") && left < 1.1, "{said}");
}

/// Over four fitted shots the force of a spring that scatters follows the length of the pulse, by chance; so would the temperatures of warmer oil, which
/// explain as much.
#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn what_follows_a_condition_by_chance_scatters_all_the_same() {
    let (said, left) = said("follows", 1);
    assert!(said.contains("F_y0 scatters from shot to shot by about") && left < 1.1, "{said}");
}

/// Shots held out have spikes, too: what they are far from no fit has said, and they do not count all the same.
#[test]
fn spikes_of_shots_held_out_do_not_count() {
    let spiked = |_, value: f64| if ((value * 1e6) as i64).rem_euclid(120) == 0 { value + 0.2 } else { value };
    let rates: crate::plain::Rates = |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 1.5 * (x[1] / 1e-3).tanh()) / 2.0];
    let report = answer(&Bench { name: "spikes", rates, recorded: spiked, ..SWING });
    check_names(&report, ("spikes", "named", "coulomb_friction", "v"), &[("F_c", 1.5)]);
    let held_out: Vec<u64> =
        report["shots"]["heldout"].as_array().expect("a list").iter().filter_map(serde_json::Value::as_u64).collect();
    let spikes = report["disturbed"]["spikes"].as_array().expect("a list");
    let is_held_out = |own: &&serde_json::Value| own["shot"].as_u64().is_some_and(|shot| held_out.contains(&shot));
    assert!(spikes.iter().filter(is_held_out).count() > 2, "{held_out:?}: {spikes:?}");
    let left = report["gap"]["heldout"]["after"].as_f64().expect("a number");
    assert!(left < 1.1, "{left}");
}
