//! Random systems: whatever the sorting makes of them, it must agree with the equations.
//!
//! Equation `k` is dominated by its own variable (or derivative): at most three others of weight 3/32 each stand against at
//! least 1/2, so that a solution exists; everything else is random: which variables are states, which others occur, linear
//! or not, which are aliases, in which order they stand.

use hyd_flat::Section;
use proptest::prelude::*;

use super::execute::{Random, Run, solve};
use super::model::Model;
use super::plans::{check_jacobian, check_simulation};
use crate::{Resolution, build_system, sort};

#[derive(Clone, Debug)]
struct Row {
    state: bool,
    fixed: bool,
    alias: Option<bool>,
    nonlinear: u8,
    others: Vec<(prop::sample::Index, i8)>,
}

fn any_row() -> impl Strategy<Value = Row> {
    let others = prop::collection::vec((any::<prop::sample::Index>(), -3..=3_i8), 0..4);
    (any::<bool>(), any::<bool>(), prop::option::weighted(0.3, any::<bool>()), 0..4_u8, others)
        .prop_map(|(state, fixed, alias, nonlinear, others)| Row { state, fixed, alias, nonlinear, others })
}

/// Declarations and equations, the latter from `shift` on in a cycle.
fn model(rows: &[Row], shift: usize) -> Model {
    let mut declarations = vec!["param p = 0.5".to_string()];
    let mut equations = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        let kind = if row.fixed && row.state { "fixed" } else { "real" };
        declarations.push(format!("{kind} x{k} = {}", k as f64 / 4.0 - 0.5));
        let own = if row.state { format!("der(x{k})") } else { format!("x{k}") };
        let mut text = match row.nonlinear {
            0 => format!("{own} + 0.125*sin({own}) = time"),
            1 => format!("p*{own} = 0.25*time"),
            _ => format!("{own} = time + p"),
        };
        for (other, weight) in &row.others {
            text.push_str(&format!(" + ({})*x{}", f64::from(*weight) / 32.0, other.index(rows.len())));
        }
        equations.push(text);
        if let Some(negated) = row.alias {
            declarations.push(format!("real a{k}"));
            equations.push(if negated { format!("a{k} + x{k} = 0") } else { format!("x{k} = a{k}") });
        }
    }
    equations.rotate_left(shift % rows.len());
    let borrowed: Vec<&str> = declarations.iter().map(String::as_str).collect();
    let equations: Vec<&str> = equations.iter().map(String::as_str).collect();
    Model::new(&borrowed, &equations)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn sorted_systems_agree_with_their_equations(
        rows in prop::collection::vec(any_row(), 1..9),
        shift in 0..8_usize,
        seed in any::<u64>(),
    ) {
        let model = model(&rows, shift);
        let aliases = rows.iter().filter(|row| row.alias.is_some()).count();
        let system = build_system(model.flat.clone());
        prop_assert!(system.resolution.iter().filter(|r| **r != Resolution::Own).count() >= aliases);
        let outcome = sort(model.flat.clone());
        let Some(sorted) = outcome.value else { panic!("{:?}", outcome.diagnostics) };
        check_simulation(&model.flat, &sorted, seed);
        check_jacobian(&sorted, false, seed);
        check_jacobian(&sorted, true, seed);
        let mut run = Run::new(&sorted);
        run.initial = true;
        run.randomize(&sorted, &sorted.initial, &mut Random(seed));
        prop_assert!(solve(&mut run, &sorted.initial));
        for violation in run.violations(&model.flat, Section::Continuous) {
            prop_assert!(violation.abs() < 1e-8, "violated by {}\n{}", violation, sorted);
        }
        let states = rows.iter().filter(|row| row.state).count();
        prop_assert_eq!(sorted.simulation.unknowns.iter().filter(|u| u.differential).count(), states);
    }
}

/// Equations solved for what they contain a thirty-second of, three times in a row: a slope of 3.4e4 in a residual that
/// bends, which a wide difference misses.
#[test]
fn steep_chains_of_assignments_have_exact_derivatives() {
    let mut declarations: Vec<String> = (0..8).map(|k| format!("real x{k} = {}", f64::from(k) / 4.0 - 0.5)).collect();
    declarations.push("param p = 0.5".to_string());
    let others =
        ["", "", " - 0.03125*x7 - 0.03125*x3", " - 0.03125*x4 - 0.03125*x0", " - 0.03125*x7", "", "", " + 0.03125*x2"];
    let equation = |(k, others): (usize, &&str)| format!("x{k} + 0.125*sin(x{k}) = time{others}");
    let equations: Vec<String> = others.iter().enumerate().map(equation).collect();
    let declarations: Vec<&str> = declarations.iter().map(String::as_str).collect();
    let equations: Vec<&str> = equations.iter().map(String::as_str).collect();
    let model = Model::new(&declarations, &equations);
    let sorted = super::plans::sorted(&model);
    check_simulation(&model.flat, &sorted, 120105233563323);
    check_jacobian(&sorted, false, 120105233563323);
    check_jacobian(&sorted, true, 120105233563323);
}
