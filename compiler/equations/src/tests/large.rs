//! Many equal equations: few templates, bounded chains, near linear time.

use std::time::Instant;

use hyd_flat::{EquationBlock, Operand, Section, Target, VarId};
use hyd_symbolic::{SlotId, Template};

use super::model::Model;
use super::plans::{check_jacobian, check_simulation};
use crate::{LARGE, LONGEST_CHAIN, SortedSystem, WIDE, WIDEST_SUPPORT, differentiate, sort};

/// A hydraulic line of n cells: der(p[k]) = c*(q[k] - q[k+1]), q[k] = g*(p[k-1] - p[k]), closed by p[0] = 0 and a throttle,
/// with an alias for every flow.
fn line(n: u32) -> Model {
    let mut model = Model::new(&["param c = 2", "param g = 3"], &[]);
    let mut array = |name: &str, count| {
        let block = model.block("real", name, count, false);
        let first = model.flat.scalars;
        model.flat.variables.push(block);
        model.flat.scalars += count;
        move |k: u32| Target::Var(VarId(first + k))
    };
    let (p, q, r) = (array("p", n + 1), array("q", n + 1), array("r", n + 1));
    let der = |target| match target {
        Target::Var(v) => Target::Der(v),
        other => other,
    };
    let (c, g) = (Target::Var(VarId(0)), Target::Var(VarId(1)));
    let [s0, s1, s2, s3] = [0, 1, 2, 3].map(|k| model.flat.templates.arena.slot(SlotId(k)));
    let arena = &mut model.flat.templates.arena;
    let difference = arena.sub(s2, s3);
    let right = arena.mul(s1, difference);
    let product = Template { left: s0, right, arity: 4 };
    let alias = Template { left: s0, right: s1, arity: 2 };
    let zero = Template { left: s0, right: arena.constant(0.0), arity: 1 };
    let mut add = |template, rows: Vec<Vec<Target>>| {
        let template = model.flat.templates.intern(template);
        let (count, section) = (rows.len() as u32, Section::Continuous);
        let operands = rows.into_iter().flatten().map(Operand::new).collect();
        let origin = model.origin();
        model.flat.equations.push(EquationBlock { section, made: false, template, count, operands, origin });
    };
    add(product, (1..=n).map(|k| vec![der(p(k)), c, q(k - 1), r(k)]).collect());
    add(product, (0..n).map(|k| vec![r(k), g, p(k), p(k + 1)]).collect());
    add(alias, (0..=n).map(|k| vec![q(k), r(k)]).collect());
    add(zero, vec![vec![p(0)]]);
    add(alias, vec![vec![q(n), p(n)]]);
    model
}

#[test]
fn a_line_of_many_cells_keeps_few_templates() {
    let small = line(20);
    let sorted = sort(small.flat.clone()).value.expect("sorted");
    check_simulation(&small.flat, &sorted, 1);
    check_jacobian(&sorted, false, 2);
    let templates = sorted.system.flat.templates.len();

    let count = 100_000;
    let model = line(count);
    let start = Instant::now();
    let mut sorted = sort(model.flat).value.expect("sorted");
    let jacobian = differentiate(&mut sorted.system, &sorted.simulation);
    // Generous: debug builds run the verifiers of all passes too.
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
    assert_eq!(sorted.system.flat.templates.len(), templates);
    assert_eq!(sorted.simulation.unknowns.len(), count as usize);
    assert_eq!(sorted.simulation.assignments.len(), count as usize);
    assert!(jacobian.state_pattern.len() <= 3 * count as usize);
    assert_eq!(jacobian.rate_pattern.len(), count as usize);
}

/// x[k] = 0.5*x[k-1] + s[k] with states s: a chain of n assignments if nothing is kept.
fn chain(n: u32) -> Model {
    let mut model = Model::new(&[], &[]);
    let mut array = |name: &str, count| {
        let block = model.block("real", name, count, false);
        let first = model.flat.scalars;
        model.flat.variables.push(block);
        model.flat.scalars += count;
        move |k: u32| VarId(first + k)
    };
    let (x, s) = (array("x", n), array("s", n));
    let arena = &mut model.flat.templates.arena;
    let [s0, s1, s2] = [0, 1, 2].map(|k| arena.slot(SlotId(k)));
    let half = arena.constant(0.5);
    let product = arena.mul(half, s1);
    let right = arena.add(product, s2);
    let step = model.flat.templates.intern(Template { left: s0, right, arity: 3 });
    let rate = model.flat.templates.intern(Template { left: s0, right: s1, arity: 2 });
    let operand = |target| Operand::new(target);
    let steps = (0..n).flat_map(|k| {
        [Target::Var(x(k)), Target::Var(if k == 0 { s(0) } else { x(k - 1) }), Target::Var(s(k))].map(operand)
    });
    let rates = (0..n).flat_map(|k| [Target::Der(s(k)), Target::Var(x(k))].map(operand));
    let (steps, rates): (Vec<_>, Vec<_>) = (steps.collect(), rates.collect());
    for (template, operands) in [(step, steps), (rate, rates)] {
        let origin = model.origin();
        let section = Section::Continuous;
        model.flat.equations.push(EquationBlock { section, made: false, template, count: n, operands, origin });
    }
    model
}

#[test]
fn long_and_wide_chains_are_broken_unless_the_system_is_small() {
    let width = |sorted: &mut SortedSystem| {
        let jacobian = differentiate(&mut sorted.system, &sorted.simulation);
        let widths = (0..sorted.simulation.assignments.len()).map(|r| jacobian.support.row(r).len());
        widths.max().expect("some")
    };
    let mut small = sort(chain(WIDE as u32 / 2).flat).value.expect("sorted");
    assert_eq!(small.simulation.unknowns.len(), WIDE / 2);
    assert_eq!(width(&mut small), WIDE / 2);
    let mut wide = sort(chain(WIDE as u32).flat).value.expect("sorted");
    assert!(width(&mut wide) <= WIDEST_SUPPORT);
    let n = LARGE as u32;
    let mut large = sort(chain(n).flat).value.expect("sorted");
    assert!(large.simulation.unknowns.len() > n as usize);
    let deepest = large.simulation.assignments.iter().map(|a| a.level).max().expect("some");
    assert!(deepest < LONGEST_CHAIN);
    assert!(width(&mut large) <= WIDEST_SUPPORT);
}

/// mean = (x[1] + ... + x[n])/n over states: one equation with very many slots.
fn wide(n: u32) -> Model {
    let mut model = Model::new(&["real mean"], &[]);
    let block = model.block("fixed", "x", n, false);
    model.flat.variables.push(block);
    model.flat.scalars += n;
    let x = |k: u32| VarId(1 + k);
    let arena = &mut model.flat.templates.arena;
    let mut terms: Vec<_> = (1..=n).map(|k| arena.slot(SlotId(k))).collect();
    while terms.len() > 1 {
        terms = terms.chunks(2).map(|p| if let [a, b] = p { arena.add(*a, *b) } else { p[0] }).collect();
    }
    let (left, number) = (arena.slot(SlotId(0)), arena.constant(f64::from(n)));
    let right = arena.div(terms[0], number);
    let (mine, mean) = (arena.slot(SlotId(1)), arena.slot(SlotId(2)));
    let difference = arena.sub(mean, mine);
    let sum = model.flat.templates.intern(Template { left, right, arity: n + 1 });
    let rate = model.flat.templates.intern(Template { left, right: difference, arity: 3 });
    let all = (0..=n).map(|k| Operand::new(Target::Var(VarId(k)))).collect();
    let rates = (0..n).flat_map(|k| [Target::Der(x(k)), Target::Var(x(k)), Target::Var(VarId(0))].map(Operand::new));
    for (template, count, operands) in [(sum, 1, all), (rate, n, rates.collect())] {
        let (origin, section) = (model.origin(), Section::Continuous);
        model.flat.equations.push(EquationBlock { section, made: false, template, count, operands, origin });
    }
    model
}

#[test]
fn an_equation_over_a_whole_array_costs_no_square() {
    let small = wide(60);
    let sorted = sort(small.flat.clone()).value.expect("sorted");
    assert_eq!(sorted.simulation.assignments.len(), 1);
    check_simulation(&small.flat, &sorted, 1);
    check_jacobian(&sorted, false, 2);

    let start = Instant::now();
    let mut sorted = sort(wide(20_000).flat).value.expect("sorted");
    let jacobian = differentiate(&mut sorted.system, &sorted.simulation);
    // Solving or differentiating once per slot took minutes.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    assert_eq!(sorted.simulation.unknowns.len(), 20_001, "the mean stays an unknown");
    assert!(jacobian.state_pattern.len() <= 3 * 20_001);
}
