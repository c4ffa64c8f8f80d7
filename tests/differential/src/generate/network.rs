//! Masses and links between connectors: a random graph, written with `connect`, meant as balances of flows.

use super::Builder;
use crate::model::{Component, Equation, Expr, Form, Network, Role, Shape, Statement, Subscript, Target, Variable};

/// Connectors, masses, links, joints without a mass, a source.
const CLASSES: &str = "connector Port
  Real T;
  flow Real q;
end Port;
model Mass
  parameter Real C = 1;
  Port p;
  Real T(start = 0.5, fixed = true);
equation
  p.T = T;
  C*der(T) = p.q;
end Mass;
model Link
  parameter Real G = 1;
  Port a;
  Port b;
  Real q;
equation
  a.q + b.q = 0;
  a.q = q;
  q = G*(a.T - b.T);
end Link;
model Source
  input Real T;
  Port p;
equation
  p.T = T;
end Source;
";

/// What a link ends at.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Mass(usize),
    Joint,
    Source,
}

/// A network: masses in an array, links in an array, one joint of links only, one source.
pub(super) fn network(b: &mut Builder) {
    if b.model.statements.iter().any(|s| matches!(s, Statement::Network(_))) {
        return;
    }
    let masses = b.random.between(1, 4) as usize;
    let part = |name: &str, count: usize| Component {
        name: name.into(),
        class: String::new(),
        count: Some(count),
        shape: Shape::Network,
        parameter: false,
        value: None,
        inherits: false,
        uneven: false,
        dropped: false,
    };
    b.model.components.push(part("mass", masses));
    let owner = b.model.components.len() - 1;
    let temperature =
        b.model.add(Variable { owner: Some(owner), ..Variable::new("T", Role::State).sized(&[masses]).starting(0.5) });
    // The joint hangs on at least two links; each mass on one at least.
    let mut ends = vec![(End::Source, End::Joint), (End::Joint, End::Mass(0))];
    for k in 1..masses {
        let other = match b.random.below(3) {
            0 => End::Joint,
            _ => End::Mass(b.random.below(k)),
        };
        ends.push(if b.random.once_in(2) { (End::Mass(k), other) } else { (other, End::Mass(k)) });
    }
    if b.random.once_in(2) {
        ends.push((End::Mass(masses - 1), End::Source));
    }
    let links = ends.len();
    b.model.components.push(part("link", links));
    let owner = b.model.components.len() - 1;
    let flow = b.model.add(Variable { owner: Some(owner), ..Variable::new("q", Role::Algebraic).sized(&[links]) });
    let name = b.fresh("j");
    let joint = b.model.add(Variable::new(name, Role::Algebraic));
    let name = b.fresh("y");
    let level = b.model.add(Variable::new(name, Role::Algebraic));
    let capacities: Vec<f64> = (0..masses).map(|_| b.random.number(0.5, 2.0)).collect();
    let conductances: Vec<f64> = (0..links).map(|_| b.random.number(0.3, 3.0)).collect();
    let source = b.bounded(2);
    // What it means.
    let one = |k: usize| Expr::Number((k + 1) as f64);
    let potential = |end: End| match end {
        End::Mass(k) => Expr::at(temperature, vec![one(k)]),
        End::Joint => Expr::name(joint),
        End::Source => Expr::name(level),
    };
    let through = |l: usize| Expr::Number(conductances[l]) * (potential(ends[l].0) - potential(ends[l].1));
    // What flows into an end.
    let into = |end: End, of: &dyn Fn(usize) -> Expr| {
        let mut sum = Expr::Number(0.0);
        for (l, (from, to)) in ends.iter().enumerate() {
            if *to == end {
                sum = sum + of(l);
            }
            if *from == end {
                sum = sum - of(l);
            }
        }
        sum
    };
    let mut meaning = vec![
        Statement::Define(Target::Name(level, Vec::new()), source.clone(), Form::Plain),
        Statement::Implicit(vec![joint], vec![Equation::Plain(into(End::Joint, &through), Expr::Number(0.0))]),
    ];
    for l in 0..links {
        let target = Target::Name(flow, vec![Subscript::At(one(l))]);
        meaning.push(Statement::Define(target, through(l), Form::Plain));
    }
    let known = |l: usize| Expr::at(flow, vec![one(l)]);
    for (k, capacity) in capacities.iter().enumerate() {
        let e = into(End::Mass(k), &known) / Expr::Number(*capacity);
        meaning.push(Statement::Derive(Target::Name(temperature, vec![Subscript::At(one(k))]), e, Form::Plain));
    }
    // How it is written: the joint is a chain of the connectors that meet there.
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let name = b.model.variables[level].name.clone();
    let declarations = format!(
        "  Mass mass[{masses}](C = {{{}}});\n  Link link[{links}](G = {{{}}});\n  Source source(T = {name});\n",
        list(&capacities),
        list(&conductances),
    );
    let mut connections = Vec::new();
    let mut last: Option<String> = None;
    for (l, (from, to)) in ends.iter().enumerate() {
        for (end, side) in [(from, "a"), (to, "b")] {
            let port = format!("link[{}].{side}", l + 1);
            let other = match end {
                End::Mass(k) => format!("mass[{}].p", k + 1),
                End::Source => "source.p".to_string(),
                End::Joint => match last.replace(port.clone()) {
                    Some(other) => other,
                    None => continue,
                },
            };
            let (first, second) = if b.random.once_in(2) { (port, other) } else { (other, port) };
            connections.push(format!("  connect({first}, {second});\n"));
        }
    }
    // The potential of the joint is that of the connectors that meet there.
    let written = Network {
        classes: CLASSES.to_string(),
        declarations,
        connections,
        equations: vec![meaning[0].clone()],
        meaning,
    };
    let first = ends.iter().position(|(_, to)| *to == End::Joint).unwrap_or(0);
    b.push(Statement::Network(Box::new(written)));
    let reading = b.model.variables[joint].name.clone();
    if let Some(Statement::Network(network)) = b.model.statements.last_mut() {
        network.connections.push(format!("  {reading} = link[{}].b.T;\n", first + 1));
    }
    b.readable.extend([Expr::at(temperature, vec![one(0)]), Expr::name(joint)]);
}
