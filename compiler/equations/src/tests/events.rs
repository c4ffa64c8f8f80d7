//! Relations, discrete equations, `when` as the flattener writes it, `reinit`.

use hyd_flat::{EquationBlock, Operand, Section, Target};
use hyd_source::Code;
use hyd_symbolic::{Node, SlotId, Template};
use hyd_system::CheckKind;

use super::execute::{Random, Run};
use super::model::Model;
use super::plans::{check_jacobian, sorted};
use crate::{Role, SortedSystem, Trigger, sort};

fn bouncing_ball() -> Model {
    let mut model = Model::new(
        &["param e = 0.7", "fixed h = 1", "fixed v = 0", "internal $when1", "discrete n = 0"],
        &["der(h) = v", "der(v) = -9.81"],
    )
    .with(
        Section::Discrete,
        &[
            "n = if $when1 and not pre($when1) and not initial() then pre(n) + 1 else pre(n)",
            "$when1 = h <= 0 and v < 0",
        ],
    );
    model.equation(Section::Reinit, "v = if $when1 and not pre($when1) and not initial() then -e*pre(v) else v");
    model
}

#[test]
fn a_when_clause_becomes_relations_discrete_equations_and_a_reinit() {
    let model = bouncing_ball();
    let sorted = sorted(&model);
    check_jacobian(&sorted, false, 3);
    assert_eq!(sorted.relations.len(), 2);
    assert!(sorted.relations.iter().all(|r| r.trigger == Trigger::State));
    let order: Vec<Target> = sorted.discrete.iter().map(|d| d.target).collect();
    assert_eq!(order, [Target::Var(model.var("$when1")), Target::Var(model.var("n"))]);
    assert_eq!(sorted.reinits.len(), 1);
    let (v, h) = (Target::Var(model.var("v")), Target::Var(model.var("h")));
    assert_eq!(sorted.reinits[0].target, v);

    // One event pass by hand: below the ground, falling.
    let mut run = Run::new(&sorted);
    run.values.extend([(h, -1e-9), (v, -2.0), (Target::Pre(model.var("v")), -2.0)]);
    for (k, relation) in sorted.relations.iter().enumerate() {
        let truth = run.value(relation.truth, relation.operands);
        assert_eq!(truth > 0.0, run.value(relation.root, relation.operands) > 0.0, "roots are positive where true");
        run.values.insert(Target::Held(k as u32), truth);
    }
    run.execute(&sorted.discrete);
    run.execute(&sorted.reinits);
    assert_eq!(run.values[&Target::Var(model.var("n"))], 1.0);
    assert_eq!(run.values[&v], 1.4);
}

#[test]
fn equal_relations_share_an_entry_and_roots_are_positive_where_true() {
    let model = Model::new(
        &["real x", "real y", "real z", "discrete d = 1"],
        &["der(x) = if x > z then 1 else 2", "y = if x > z then time else x", "z = if y >= x*z then 1 else 0"],
    )
    .with(Section::Discrete, &["d = if y < z then 1 else pre(d)"]);
    let sorted = sorted(&model);
    assert_eq!(sorted.relations.len(), 3);
    for seed in 1..50 {
        let mut run = Run::new(&sorted);
        run.randomize(&sorted, &sorted.simulation, &mut Random(seed));
        for relation in &sorted.relations {
            let (truth, root) =
                (run.value(relation.truth, relation.operands), run.value(relation.root, relation.operands));
            // At zero `>=` is true already; the sign then says nothing.
            assert!(root == 0.0 || (truth == 1.0) == (root > 0.0));
        }
    }
}

fn instants(sorted: &SortedSystem) -> Vec<Option<f64>> {
    let run = Run::new(sorted);
    let instant = |trigger| match trigger {
        Trigger::Time { instant, .. } => Some(instant),
        Trigger::State => None,
    };
    sorted.relations.iter().map(|r| instant(r.trigger).map(|at| run.value(at, r.operands))).collect()
}

#[test]
fn relations_of_time_and_fixed_values_are_time_events() {
    let model = Model::new(
        &["param t0 = 3", "discrete n = 2", "real x", "real y"],
        &["der(x) = if time >= t0 then 1 else 0", "y = if 2*time < t0 - 1 then 1 else 0"],
    )
    .with(Section::Discrete, &["n = if time > pre(n)*t0 then pre(n) + 1 else pre(n)"]);
    let sorted = sorted(&model);
    assert_eq!(instants(&sorted), [Some(3.0), Some(1.0), Some(0.0)]);
    let model = Model::new(&["real x"], &["der(x) = if sin(time) > 0 or time > x then 1 else 0"]);
    assert_eq!(instants(&super::plans::sorted(&model)), [None, None]);
}

#[test]
fn relations_that_only_events_change_are_literal() {
    let model = Model::new(
        &["param p = 1", "discrete n = 2", "boolean b", "real x", "real y"],
        &["der(x) = if p > 0 and n > 1 then x else y", "y = if x == 2 then 1 else 0"],
    )
    .with(Section::Discrete, &["n = pre(n)", "b = n >= p"]);
    let sorted = sorted(&model);
    assert!(sorted.relations.is_empty(), "{sorted}");
}

#[test]
fn discrete_aliases_and_their_pre_values_are_joined() {
    let model = Model::new(&["real x", "boolean a", "boolean b", "boolean c"], &["der(x) = if c then 1 else -1"])
        .with(Section::Discrete, &["a = x > 1", "b = a", "c = b and not pre(b)"]);
    let sorted = sorted(&model);
    assert_eq!(sorted.discrete.len(), 2);
    assert_eq!(sorted.system.roles[model.var("b")], Role::Discrete);
    let read = sorted.system.operands_of(sorted.discrete[1].operands);
    assert!(read.contains(&Operand::new(Target::Pre(model.var("a")))), "{sorted}");
}

#[test]
fn cycles_of_discrete_variables_are_named() {
    let model = Model::new(&["boolean a", "boolean b", "boolean c"], &[])
        .with(Section::Discrete, &["a = not b", "b = a and c", "c = pre(a)"]);
    let outcome = sort(model.flat);
    assert!(outcome.value.is_none());
    assert_eq!(outcome.diagnostics[0].code, Code::DiscreteLoop);
    assert!(outcome.diagnostics[0].message.contains("`a`, `b`"), "{}", outcome.diagnostics[0].message);
    let model = Model::new(&["boolean a"], &[]).with(Section::Discrete, &["a = not a"]);
    assert_eq!(sort(model.flat).diagnostics[0].code, Code::DiscreteLoop);
}

#[test]
fn conditions_are_kept_and_terminations_make_events() {
    let mut model = Model::new(&["real x"], &["der(x) = 1"]);
    for section in [Section::Assert(0), Section::Terminate(1)] {
        let arena = &mut model.flat.templates.arena;
        let (x, limit) = (arena.slot(SlotId(0)), arena.constant(5.0));
        let left = arena.intern(Node::Event(hyd_symbolic::Relation::Less, x, limit));
        let right = arena.constant(0.0);
        let template = model.flat.templates.intern(Template { left, right, arity: 1 });
        let operands = vec![Operand::new(Target::Var(model.var("x")))];
        let origin = model.origin();
        model.flat.equations.push(EquationBlock { section, made: false, template, count: 1, operands, origin });
    }
    let sorted = sorted(&model);
    let kinds: Vec<_> = sorted.checks.iter().map(|c| (c.message, c.kind)).collect();
    assert_eq!(kinds, [(0, CheckKind::Assert), (1, CheckKind::Terminate)]);
    assert_eq!(sorted.relations.len(), 1, "only the termination makes events");
}

#[test]
fn sections_follow_what_an_equation_determines() {
    // A discrete Real determined outside `when`, and a continuous variable that takes over a discrete one.
    let model = Model::new(&["real x", "discrete d", "discrete e", "real y"], &["der(x) = d + y", "e = 2*d"])
        .with(Section::Discrete, &["d = if x > 1 then 1 else pre(d)", "e = y"]);
    let sorted = sorted(&model);
    assert_eq!(sorted.discrete.len(), 2, "{sorted}");
    assert!(sorted.simulation.assignments.iter().any(|a| a.target == Target::Var(model.var("y"))), "{sorted}");
}

#[test]
fn initial_equations_of_discrete_variables_are_starts() {
    let model = Model::new(&["param p = 3", "fixed x = 1", "discrete d = 9", "discrete e"], &["der(x) = d + e"])
        .with(Section::Discrete, &["d = if x > 2 then 1 else pre(d)", "e = if x > 3 then 1 else pre(e)"])
        .with(Section::Initial, &["pre(d) = 2*p", "e = p + 1"]);
    let sorted = sorted(&model);
    let run = Run::new(&sorted);
    assert_eq!(run.values[&Target::Start(model.var("d"))], 6.0);
    assert_eq!(run.values[&Target::Start(model.var("e"))], 4.0);
    assert!(sorted.initial.unknowns.is_empty());
}

#[test]
fn reinit_needs_a_state() {
    let mut model = Model::new(&["real x", "real y"], &["der(x) = y", "y = sin(time)"]);
    model.equation(Section::Reinit, "y = if x > 1 then 0 else y");
    assert_eq!(sort(model.flat).diagnostics.last().expect("an error").code, Code::Misplaced);
}

#[test]
fn variables_known_before_the_run_make_time_events_too() {
    let model = Model::new(
        &["param p = 3", "real until", "real x"],
        &["until = 2*p", "der(x) = if time < until then 1 else 0"],
    );
    assert_eq!(instants(&sorted(&model)), [Some(6.0)]);
}
