//! Two effects that a bench cannot tell apart get no name, but the measurement that would.

use std::fs;

use crate::{OWN_LIBRARY, folder, report_of, study_with, thinned};

/// Another effect that differs from the first by one or two hundredths over the pressures of a bench.
const OOZING: &str = "  model Ooze \"oil oozes\"
    extends Hyd.Places.PartialLeakage;
    parameter Hyd.Units.HydraulicConductance k = 1e-11;
    constant Real c(unit = \"1/Pa\") = 1e-9;
  equation
    q = k*dp*(1 + c*dp);
    annotation(__hyd(effect(id = \"oozing\", kind = \"physics\", at = {\"leakage\"}, adds = k, zero = 0, probe = 1e-11,
      prior = \"lognormal(1e-11, 0.8)\", words = \"oil that oozes\")));
  end Ooze;
end Workshop;";

#[test]
fn effects_that_look_alike_are_not_named_but_told_apart_by_another_shot() {
    let folder = folder("alike");
    fs::create_dir_all(folder.join("libraries/Workshop")).expect("made");
    let library = OWN_LIBRARY.replace("end Workshop;", OOZING);
    fs::write(folder.join("libraries/Workshop/package.hyd"), library).expect("written");
    study_with(&folder, "without = [\"Hyd.Effects\"]", &[]);
    let report = report_of(&folder, &thinned(&folder, "bench/B03", 4));
    assert_eq!(report["status"], "ambiguous", "{report:#}");
    let mut ids: Vec<&str> =
        report["ambiguous"].as_array().expect("a list").iter().filter_map(|id| id.as_str()).collect();
    ids.sort_unstable();
    assert_eq!(ids, ["oozing", "seeping"]);
    assert!(!folder.join("report/discovered.hyd").exists());
    // The two differ in how the leak grows with the pressure, so a shot at a higher pressure tells more than one at a lower.
    let further = report["further"].as_array().expect("a list");
    let apart = |part: &str| {
        let own = further.iter().find(|own| own["measurement"].as_str().is_some_and(|words| words.contains(part)));
        own.unwrap_or_else(|| panic!("{part}: {report:#}"))["apart"].as_f64().expect("a number")
    };
    assert!(apart("p0_Pa = 2.1e7") > apart("p0_Pa = 1.05e7"), "{further:#?}");
    let figures: Vec<f64> = further.iter().filter_map(|own| own["apart"].as_f64()).collect();
    assert!(figures.len() == further.len() && figures.windows(2).all(|pair| pair[0] >= pair[1]), "{figures:?}");
    let _ = fs::remove_dir_all(&folder);
}
