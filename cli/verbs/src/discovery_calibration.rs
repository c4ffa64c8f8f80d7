//! `STUDY.calibration.json`, beside the study: drops of the cost on sets on which nothing is missing, for later searches of the same set.
//!
//! The file holds a hash of study, set, tables, model and libraries' effects; of anything else it is not taken.

use std::path::{Path, PathBuf};

use hyd_discovery::Calibration;
use serde_json::{Value, json};

use crate::Failure;

fn path(study: &Path) -> PathBuf {
    study.with_extension("calibration.json")
}

/// What was found out for this search before.
pub(crate) fn known(study: &Path, hash: u64) -> Option<Calibration> {
    let own: Value = serde_json::from_str(&std::fs::read_to_string(path(study)).ok()?).ok()?;
    if own["search"] != format!("{hash:016x}") {
        return None;
    }
    let cost_drops = own["cost_drops"].as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    Some(Calibration { cost_drops })
}

/// Keeps it.
pub(crate) fn keep(study: &Path, hash: u64, calibration: &Calibration) -> Result<(), Failure> {
    let path = path(study);
    let text =
        json!({"search": format!("{hash:016x}"), "needed": calibration.needed(), "cost_drops": calibration.cost_drops});
    hyd_results::write_whole(&path, format!("{text:#}\n").as_bytes())
        .map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display())))
}
