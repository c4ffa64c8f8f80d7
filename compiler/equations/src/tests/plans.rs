//! Simulation plans against the flat equations, and Jacobians against differences.

use hyd_flat::{FlatModel, Section, Target};

use super::execute::{Random, Run, composed, solve};
use super::model::Model;
use crate::{EquationSystem, Plan, Resolution, Role, SortedSystem, differentiate, sort};

pub(crate) fn sorted(model: &Model) -> SortedSystem {
    let outcome = sort(model.flat.clone());
    outcome.value.unwrap_or_else(|| panic!("{:?}", outcome.diagnostics))
}

/// Solves the simulation plan for rates and algebraic unknowns at a random point and checks all continuous equations.
pub(crate) fn check_simulation(flat: &FlatModel, sorted: &SortedSystem, seed: u64) {
    let mut run = Run::new(sorted);
    run.randomize(sorted, &sorted.simulation, &mut Random(seed));
    assert!(solve(&mut run, &sorted.simulation), "no solution");
    for violation in run.violations(flat, Section::Continuous) {
        assert!(violation.abs() < 1e-8, "violated by {violation}\n{sorted}");
    }
}

/// Half widths of the differences.  Chains of assignments may divide by small coefficients many times; where a residual bends as
/// strongly as that makes it, only the narrower differences are its slope; where values are as large, only the wider ones are not
/// lost in rounding.
const DIFFERENCES: [f64; 5] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

/// Composed derivatives against central differences, and the pattern against the non-zeros.
pub(crate) fn check_jacobian(sorted: &SortedSystem, initial: bool, seed: u64) {
    let mut system: EquationSystem = sorted.system.clone();
    let plan: &Plan = if initial { &sorted.initial } else { &sorted.simulation };
    let jacobian = differentiate(&mut system, plan);
    let mut run = Run::new(sorted);
    run.system = &system;
    run.initial = initial;
    run.randomize(sorted, plan, &mut Random(seed));
    let exact = composed(&run, plan, &jacobian);
    let n = plan.unknowns.len();
    for c in 0..2 * n {
        let unknown = plan.unknowns[c % n];
        let target = match (c < n, unknown.differential, unknown.target) {
            (true, _, target) => target,
            (false, true, Target::Var(v)) => Target::Der(v),
            _ => continue,
        };
        let at = run.values[&target];
        let mut side = |shift: f64| {
            run.values.insert(target, at + shift);
            run.execute(&plan.assignments);
            run.residuals(plan)
        };
        let differences = DIFFERENCES.map(|h| (side(h), side(-h), 2.0 * h));
        side(0.0);
        for r in 0..n {
            let value = exact[r].get(&(c as u32)).copied().unwrap_or(0.0);
            let slopes = differences.each_ref().map(|(up, down, h)| (up[r] - down[r]) / h);
            let scale = value.abs().max(1.0);
            let agrees = slopes.iter().any(|slope| (value - slope).abs() < 1e-6 * scale);
            assert!(agrees, "row {r} column {c}: {value} {slopes:?}\n{sorted}");
            let entry = (r as u32, (c % n) as u32);
            let pattern = if c < n { &jacobian.state_pattern } else { &jacobian.rate_pattern };
            assert!(value == 0.0 || pattern.binary_search(&entry).is_ok(), "{entry:?} is missing in the pattern");
        }
    }
}

fn check(model: &Model) -> SortedSystem {
    let sorted = sorted(model);
    for seed in 1..6 {
        check_simulation(&model.flat, &sorted, seed);
        check_jacobian(&sorted, false, seed);
        check_jacobian(&sorted, true, seed);
    }
    sorted
}

/// A resistor and a capacitor at a voltage source, as connections make it.
pub(crate) fn rc_circuit() -> Model {
    Model::new(
        &[
            "param R = 2",
            "param C = 0.5",
            "real s.p.v",
            "real s.p.i",
            "real s.n.v",
            "real s.n.i",
            "real s.v",
            "real r.p.v",
            "real r.p.i",
            "real r.n.v",
            "real r.n.i",
            "real r.v",
            "real r.i",
            "real c.p.v",
            "real c.p.i",
            "real c.n.v",
            "real c.n.i",
            "fixed c.v = 1",
            "real c.i",
            "real g.p.v",
            "real g.p.i",
        ],
        &[
            "s.v = s.p.v - s.n.v",
            "0 = s.p.i + s.n.i",
            "s.v = sin(time)",
            "r.v = r.p.v - r.n.v",
            "0 = r.p.i + r.n.i",
            "r.i = r.p.i",
            "r.v = R*r.i",
            "c.v = c.p.v - c.n.v",
            "0 = c.p.i + c.n.i",
            "c.i = c.p.i",
            "C*der(c.v) = c.i",
            "g.p.v = 0",
            "s.p.v = r.p.v",
            "s.p.i + r.p.i = 0",
            "r.n.v = c.p.v",
            "r.n.i + c.p.i = 0",
            "c.n.v = g.p.v",
            "s.n.v = g.p.v",
            "c.n.i + g.p.i + s.n.i = 0",
        ],
    )
}

#[test]
fn rc_circuit_shrinks_to_one_state() {
    let model = rc_circuit();
    let sorted = check(&model);
    assert_eq!(sorted.simulation.unknowns.len(), 1);
    assert_eq!(sorted.simulation.unknowns[0].target, Target::Var(model.var("c.v")));
    assert!(sorted.initial.unknowns.is_empty(), "{sorted}");
    let system = &sorted.system;
    let own = |v| system.is_own(v) && system.roles[v] == Role::Algebraic;
    // Left are s.v, r.v, one current and the current into the ground, which is zero only numerically.
    assert!(system.roles.indices().filter(|&v| own(v)).count() <= 4, "{system}");
    assert_eq!(system.resolution[model.var("c.p.v")], Resolution::Alias { of: model.var("c.v"), negated: false });
}

#[test]
fn derivatives_of_aliases_follow_with_the_sign() {
    let model = Model::new(&["real x", "fixed y = 3", "real u"], &["y = -x", "der(x) = u", "u = 2*der(y) + y*time"]);
    let sorted = check(&model);
    let (x, y) = (model.var("x"), model.var("y"));
    assert_eq!(sorted.system.resolution[x], Resolution::Alias { of: y, negated: true });
    assert_eq!(sorted.system.roles[x], Role::State);
}

#[test]
fn a_fixed_value_makes_its_derivative_zero() {
    let model = Model::new(&["real a", "real b", "real c"], &["a = 0", "b = c + a*c", "c = der(a) + sin(time)"]);
    let sorted = check(&model);
    assert!(matches!(sorted.system.resolution[model.var("a")], Resolution::Value(_)));
    assert!(!sorted.system.is_own(model.var("b")) || !sorted.system.is_own(model.var("c")), "{sorted}");
}

#[test]
fn starts_move_to_the_variable_that_is_kept() {
    let start = |model: &Model, name| {
        let sorted = sorted(model);
        Run::new(&sorted).values[&Target::Start(model.var(name))]
    };
    // The state x is kept and takes the fixed start of its negative, not the free one of its equal.
    let equations = ["y = -x", "z = x", "der(x) = 1"];
    assert_eq!(start(&Model::new(&["real x", "fixed y = 3", "real z = 7"], &equations), "x"), -3.0);
    // Of two states the one with the fixed start is kept.
    let equations = ["y = -2*x/2", "der(x) = 1 + 0*der(y)", "z = der(y)"];
    assert_eq!(start(&Model::new(&["real x = 1", "fixed y = 3", "real z"], &equations), "y"), 3.0);
    let model = Model::new(&["real x", "fixed y = 3"], &["y = -x", "der(x) = 1"]);
    let sorted = sorted(&model);
    let mut run = Run::new(&sorted);
    run.execute(&sorted.initial.assignments);
    assert_eq!(run.values[&Target::Var(model.var("x"))], -3.0, "{sorted}");
}

#[test]
fn a_nonlinear_loop_is_torn_to_one_unknown() {
    // Two orifices in series: four algebraic variables in one loop.
    let model = Model::new(
        &["param ps = 9", "real p = 4", "real q1", "real q2", "real d1", "real d2", "real x"],
        &["d1 = ps - p", "d2 = p - x", "q1 = 2*d1*abs(d1)", "q2 = 3*d2*abs(d2)", "q1 = q2", "der(x) = q2 - x"],
    );
    let sorted = check(&model);
    let unknowns: Vec<_> = sorted.simulation.unknowns.iter().map(|u| (u.target, u.differential)).collect();
    assert_eq!(unknowns.len(), 2, "{sorted}");
    assert!(unknowns.contains(&(Target::Var(model.var("p")), false)), "{sorted}");
}

#[test]
fn linear_loops_and_implicit_equations() {
    let model = Model::new(
        &["param a = 2", "real x", "real y", "real z", "real w", "real v = 1"],
        &["a*x + y = time", "x - a*y = z", "der(z) = -x - w", "w + sin(w) = z", "z*der(v) + x*der(v)^3 = exp(v)"],
    );
    let sorted = check(&model);
    assert_eq!(sorted.simulation.unknowns.iter().filter(|u| u.differential).count(), 2);
    assert_eq!(sorted.simulation.unknowns.len(), 4, "one for the linear loop, one for w\n{sorted}");
}

#[test]
fn dividing_by_a_variable_is_avoided() {
    let model = Model::new(&["real x", "real y"], &["x*y = time", "der(x) = y"]);
    let sorted = check(&model);
    assert_eq!(sorted.simulation.assignments.len(), 0, "{sorted}");
}

#[test]
fn parameter_dependent_variables_are_computed_before_the_run() {
    let model = Model::new(
        &["param c = a + b", "param b = 2*a", "param a = 1.5", "const k = 2", "real u", "real w", "real x"],
        &["u = c*k", "w + u = a", "der(x) = w - x"],
    );
    let sorted = check(&model);
    let order: Vec<Target> = sorted.bindings.iter().map(|b| b.target).collect();
    let place = |name: &str| order.iter().position(|&t| t == Target::Var(model.var(name))).expect("bound");
    assert!(place("a") < place("b") && place("b") < place("c") && place("c") < place("u") && place("u") < place("w"));
    assert!(sorted.simulation.assignments.is_empty());
    let run = Run::new(&sorted);
    assert_eq!(run.values[&Target::Var(model.var("w"))], 1.5 - 9.0);
}

#[test]
fn derivatives_read_by_other_equations_cost_no_loop() {
    let model = Model::new(
        &["param m = 2", "real s", "real v", "real a", "real f"],
        &["der(s) = v", "der(v) = a", "m*a = f", "f = -3*s - 0.1*v"],
    );
    let sorted = check(&model);
    assert_eq!(sorted.simulation.unknowns.len(), 2, "{sorted}");
    assert!(sorted.simulation.unknowns.iter().all(|u| u.differential));
}

#[test]
fn a_velocity_is_read_rather_than_the_rate_of_the_position() {
    let model = Model::new(
        &["real s", "real v", "real w", "real u", "real f"],
        &["v + der(s) = 0", "der(v) = f", "w = 2*der(s)", "u = der(s)", "f = -3*s - 0.1*w + u"],
    );
    let sorted = check(&model);
    let rates = sorted.system.equations_in(Section::Continuous).into_iter().filter(|&eq| {
        let operands = sorted.system.operands_of(sorted.system.equations[eq].operands);
        operands.iter().any(|o| o.target() == Target::Der(model.var("s")))
    });
    assert_eq!(rates.count(), 1, "{sorted}");
    let kept = Resolution::Alias { of: model.var("v"), negated: true };
    assert_eq!(sorted.system.resolution[model.var("u")], kept);
}

#[test]
fn chains_of_aliases_found_one_after_the_other_end_at_the_last() {
    // w and x are aliases at once, w of v only when der(s) is read as v; y is -x; z is zero because der(a) is.
    let model = Model::new(
        &["real s", "real v", "real w", "real x", "real y", "real a", "real z", "real z2"],
        &["der(s) = v", "der(v) = -s - x", "w = der(s)", "x = w", "y = -x", "a = 4", "z = der(a)", "z2 + z = y - y"],
    );
    let sorted = check(&model);
    let v = model.var("v");
    for (name, negated) in [("w", false), ("x", false), ("y", true)] {
        assert_eq!(sorted.system.resolution[model.var(name)], Resolution::Alias { of: v, negated }, "{name}");
        assert_eq!(sorted.system.roles[model.var(name)], Role::State);
    }
    assert!(matches!(sorted.system.resolution[model.var("z2")], Resolution::Value(_)), "{}", sorted.system);
}
