//! Models that are accepted do not depend on the base units (Bridgman, "Dimensional Analysis", 1922).
//!
//! If kilogram, metre, second, ampere and kelvin are made larger or smaller and all values changed with them, the residual
//! of each equation must change by one factor, whatever the values.  This uses the values of the expressions only,
//! nothing of the inference but the units of variables.
#![allow(clippy::disallowed_methods)]

use std::path::Path;

use hyd_flat::{FlatModel, Operand, Section, Target};
use hyd_symbolic::eval;

use super::support::flatten;
use crate::{Unit, check_units, parse_unit};

/// Numbers in (0, 1), the same in each run (Park and Miller 1988).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48271 % 2147483647;
        self.0 as f64 / 2147483647.0
    }
}

fn scale_of(unit: &Unit, scales: &[f64; 7]) -> f64 {
    unit.dimension.0.iter().zip(scales).map(|(e, s)| s.powf(e.value())).product()
}

/// Units of all scalars, declared or found.
fn units(flat: &FlatModel, report: &crate::UnitReport) -> Vec<Option<Unit>> {
    let mut units = vec![None; flat.scalars as usize];
    for block in flat.variables.raw.iter() {
        let declared = match &block.unit {
            Some(text) => parse_unit(text).ok(),
            None if block.kind != hyd_system::ValueKind::Real => Some(Unit::ONE),
            None => None,
        };
        units[block.first.0 as usize..(block.first.0 + block.count) as usize].fill(declared);
    }
    for found in &report.inferred {
        let unit = parse_unit(&found.unit).ok();
        units[found.variable.0 as usize..(found.variable.0 + found.count) as usize].fill(unit);
    }
    units
}

/// Factor by which the residual of an equation changes, at one point; `None` where the residual says nothing.
fn change(
    flat: &FlatModel,
    e: usize,
    k: usize,
    units: &[Option<Unit>],
    scales: &[f64; 7],
    random: &mut Random,
) -> Option<f64> {
    let block = &flat.equations[e];
    let template = flat.templates.get(block.template);
    let operands = block.operands_of(k, template.arity as usize);
    let mut values = Vec::new();
    for operand in operands {
        let (value, scale) = match operand.target() {
            Target::Const(c) => (flat.constants[c], 1.0),
            Target::Held(_) | Target::Chosen(_) => (1.0, 1.0),
            Target::Delayed(_) | Target::DelayedRate(_) | Target::Input(_) | Target::InputRate(_) => return None,
            Target::Der(v) => (random.next() + 0.1, scale_of(&units[v.0 as usize]?, scales) / scales[2]),
            Target::Var(v) | Target::Pre(v) | Target::Start(v) => {
                (random.next() + 0.1, scale_of(&units[v.0 as usize]?, scales))
            }
        };
        let value = if Operand::negated(*operand) { -value } else { value };
        values.push((value, value * scale));
    }
    let time = random.next();
    let arena = &flat.templates.arena;
    let side = |root, scaled: bool| {
        let value = |s: hyd_symbolic::SlotId| if scaled { values[s.0 as usize].1 } else { values[s.0 as usize].0 };
        eval(arena, root, value, if scaled { time * scales[2] } else { time }, false)
    };
    let before = (side(template.left, false), side(template.right, false));
    let after = (side(template.left, true), side(template.right, true));
    let (residual, scaled) = (before.0 - before.1, after.0 - after.1);
    let size = before.0.abs().max(before.1.abs());
    (residual.abs() > 1e-4 * size && size > 0.0).then(|| scaled / residual)
}

/// Number of equations whose residual scales, and those whose does not.
fn scaling(flat: &FlatModel, report: &crate::UnitReport) -> (usize, Vec<String>) {
    let units = units(flat, report);
    let mut random = Random(20240229);
    let (mut good, mut bad) = (0, Vec::new());
    for (e, block) in flat.equations.iter().enumerate() {
        if !matches!(block.section, Section::Continuous | Section::Initial) {
            continue;
        }
        for k in 0..block.count.min(3) as usize {
            let scales: [f64; 7] = std::array::from_fn(|_| 0.5 + 2.0 * random.next());
            let changes: Vec<f64> = (0..12).filter_map(|_| change(flat, e, k, &units, &scales, &mut random)).collect();
            let uniform = changes.iter().all(|c| (c / changes[0] - 1.0).abs() < 1e-6 || c.is_nan());
            if changes.len() > 1 && uniform {
                good += 1;
            } else if changes.len() > 1 {
                let template = flat.templates.get(block.template);
                let operands = block.operands_of(k, template.arity as usize);
                bad.push(format!("{} = {}", flat.print(template.left, operands), flat.print(template.right, operands)));
            }
        }
    }
    (good, bad)
}

#[test]
fn accepted_models_do_not_depend_on_the_base_units() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let mut total = 0;
    for folder in ["single_acting_drive", "hydraulic_line"] {
        let list = std::fs::read_dir(models.join(folder)).expect("models");
        let mut files: Vec<_> = list.map(|f| f.expect("file").path()).collect();
        files.sort();
        for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "hyd")) {
            let name = file.display().to_string();
            let front = flatten(&name, &std::fs::read_to_string(file).expect("text"));
            let Some(flat) = &front.flat else { continue };
            let report = check_units(flat, &front.files);
            assert!(report.diagnostics.is_empty(), "{name}: {:?}", report.diagnostics);
            let (good, bad) = scaling(flat, &report);
            assert!(bad.is_empty(), "{name}: {bad:#?}");
            total += good;
        }
    }
    assert!(total > 2000, "only {total} equations looked at");
}

#[test]
fn the_library_fits_its_units() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../stdlib/Hyd");
    let (mut folders, mut models) = (vec![root], 0);
    while let Some(folder) = folders.pop() {
        for file in std::fs::read_dir(folder).expect("library").map(|f| f.expect("file").path()) {
            if file.is_dir() {
                folders.push(file);
            } else if file.extension().is_some_and(|e| e == "hyd") {
                let name = file.display().to_string();
                let front = flatten(&name, &std::fs::read_to_string(&file).expect("text"));
                let Some(flat) = &front.flat else { continue };
                let report = check_units(flat, &front.files);
                assert!(report.diagnostics.is_empty(), "{name}: {:?}", report.diagnostics);
                models += 1;
            }
        }
    }
    assert!(models > 140, "{models}");
}

#[test]
fn a_wrong_model_shows_in_the_scaling_too() {
    // Of these three the check refuses the last two, and exactly these depend on the base units.
    let text = "model M
  Real x(unit = \"m\"); Real A(unit = \"m2\"); Real t(unit = \"s\"); Real v(unit = \"m/s\");
equation
  x = v*t + sqrt(A);
  A = x*x + v;
  t = x;
  x = 2*x + v*time;
end M;";
    let checked = super::support::check_text(text);
    let (good, bad) = scaling(&checked.flat, &checked.report);
    assert_eq!((good, bad.len(), checked.report.diagnostics.len()), (2, 2, 2), "{bad:?}");
}
