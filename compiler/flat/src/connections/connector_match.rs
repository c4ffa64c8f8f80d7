//! Whether the two sides of a `connect` fit: sizes, and elements with name, flow or potential, type and sizes
//! (Modelica 3.6, section 9.3); and whether a connected input has one source.

use hyd_instance::InstId;
use hyd_source::{Code, Diagnostic, Edit, Span};
use hyd_syntax::tree::{ClassKind, Direction};

use crate::connections::connect::{Leaf, Side};
use crate::connections::other_ends::End;
use crate::model::VarId;
use crate::state::context::Fail;
use crate::state::flattener::Flattener;

/// Names that variables have which add up to zero where parts are joined.
const FLOWS: [&str; 14] =
    ["f", "F", "i", "I", "q", "Q", "tau", "torque", "m_flow", "V_flow", "H_flow", "Q_flow", "Phi", "force"];

/// Inputs that may have been meant, in a message.
const MOST_OTHERS: usize = 3;

impl Flattener<'_, '_> {
    /// Reports an error if what a `connect` joins does not fit.
    pub(crate) fn check_connectors(
        &mut self,
        span: Span,
        [a, b]: [Span; 2],
        left: &Side,
        right: &Side,
    ) -> Result<(), Fail> {
        if left.shape != right.shape {
            return Err(self.sizes_differ(span, (a, left), (b, right)));
        }
        // They have the elements of both, and only what is on both sides is joined.
        if [left, right].iter().all(|side| self.scopes.instances[side.inst].expandable) {
            return Ok(());
        }
        let (x, y) = (self.leaves(left.inst), self.leaves(right.inst));
        self.check_flows(left.inst, &x);
        let alike = |a: &Leaf, b: &Leaf| {
            let (p, q) = (&self.scopes.instances[a.inst], &self.scopes.instances[b.inst]);
            let scalars = p.primitive.as_ref().zip(q.primitive.as_ref());
            (&a.path, a.flow, a.stream, self.inner_sizes(a)) == (&b.path, b.flow, b.stream, self.inner_sizes(b))
                && scalars.is_some_and(|(p, q)| p.scalar.name() == q.scalar.name())
        };
        if x.len() == y.len() && x.iter().zip(&y).all(|(a, b)| alike(a, b)) {
            return Ok(());
        }
        let describe = |flat: &Self, leaf: &Leaf| {
            let own = &flat.scopes.instances[leaf.inst];
            let scalar = own.primitive.as_ref().map_or("", |p| p.scalar.name());
            (leaf.path.clone(), leaf.flow, leaf.stream, scalar.to_string(), flat.inner_sizes(leaf).to_vec())
        };
        let list = |leaves: &[Leaf]| leaves.iter().map(|l| describe(self, l)).collect::<Vec<_>>();
        let (mut p, mut q) = (list(&x), list(&y));
        p.sort();
        q.sort();
        if p == q {
            return Ok(());
        }
        let left = End { inst: left.inst, span: a, leaves: &x };
        Err(self.kinds_differ(span, &left, &End { inst: right.inst, span: b, leaves: &y }))
    }

    /// Connectors of the user's own text of which all variables are potentials: connected ones are all set equal, and nothing balances.
    fn check_flows(&mut self, connector: InstId, leaves: &[Leaf]) {
        let instances = &self.scopes.instances;
        let is_plain = |leaf: &Leaf| {
            let own = &instances[leaf.inst];
            !leaf.flow && !leaf.stream && own.direction.is_none() && own.parent == Some(connector)
        };
        let is_own = |leaf: &Leaf| Some(instances[leaf.inst].span.file) == self.scopes.table.main;
        if leaves.len() < 2
            || !leaves.iter().all(|leaf| is_plain(leaf) && is_own(leaf))
            || instances[connector].direction.is_some()
        {
            return;
        }
        let Some(class) = instances[connector].class else { return };
        let likely = leaves.iter().find(|leaf| FLOWS.contains(&&*leaf.path));
        let declared = self.scopes.table.class(class).def.name.span;
        let name = self.scopes.table.class(class).def.name.name.clone();
        let known = |own: &Diagnostic| {
            own.code == Code::ConnectorMismatch && own.labels.first().is_some_and(|label| label.span == declared)
        };
        if !self.scopes.table.messages.iter().any(known) {
            let message = format!(
                "the connector `{name}` has {} potentials and no `flow` variable: a connection sets all of them equal",
                leaves.len()
            );
            let mut warning = Diagnostic::warning(Code::ConnectorMismatch, message).at(declared, "");
            match likely {
                Some(leaf) => {
                    let span = self.scopes.instances[leaf.inst].span;
                    warning = warning
                        .with(span, "declared here")
                        .help(format!("is `{path}` what adds up to zero where parts are joined? Then declare it with `flow`: `flow Real {path}`", path = leaf.path));
                    if let Some(begin) = self.begin_of(span) {
                        let edit = Edit { span: begin, text: "flow ".to_string() };
                        warning = warning.propose(format!("make `{}` a flow", leaf.path), vec![edit]);
                    }
                }
                None => warning = warning.help("what adds up to zero where parts are joined (a current, a force, a flow rate) is declared with `flow`"),
            }
            self.report(warning);
        }
    }

    /// The begin of the declaration of a name, after the end of what stands before it.
    fn begin_of(&self, name: Span) -> Option<Span> {
        let text = self.scopes.table.files.text(name.file);
        let before = text.get(..name.start as usize)?;
        let from = before.rfind([';', '\n']).map_or(0, |at| at + 1);
        let at = from + (before[from..].len() - before[from..].trim_start().len());
        Some(Span::new(name.file, at, at))
    }

    /// Sizes of a variable within its connector; where it is the connector itself, its sizes say which elements there are.
    fn inner_sizes(&self, leaf: &Leaf) -> &[usize] {
        if leaf.path.is_empty() { &[] } else { &self.scopes.instances[leaf.inst].dims }
    }

    /// Says that one connector has other sizes than the other.
    fn sizes_differ(&mut self, span: Span, (a, left): (Span, &Side), (b, right): (Span, &Side)) -> Fail {
        let text = |span: Span| self.scopes.table.files.snippet(span).to_string();
        let sizes = |shape: &[usize]| match shape {
            [] => "is a single connector".to_string(),
            shape => format!("has the sizes {shape:?}"),
        };
        let (p, q) = (sizes(&left.shape), sizes(&right.shape));
        let message = format!("`{}` {p}, but `{}` {q}", text(a), text(b));
        let (first, second) = (self.scopes.instances[left.inst].span, self.scopes.instances[right.inst].span);
        let mut diagnostic = Diagnostic::error(Code::ConnectorMismatch, message).at(span, "").with(first, p);
        if second != first {
            diagnostic = diagnostic.with(second, q);
        }
        self.report(diagnostic);
        Fail::Reported
    }

    /// Says in what two connectors differ.
    fn kinds_differ(&mut self, span: Span, left: &End<'_>, right: &End<'_>) -> Fail {
        let ((a, x), (b, y)) = ((left.span, left.leaves), (right.span, right.leaves));
        let names = |leaves: &[Leaf]| {
            let sizes = |l: &Leaf| match self.inner_sizes(l) {
                [] => String::new(),
                sizes => format!("{sizes:?}"),
            };
            let texts: Vec<String> = leaves
                .iter()
                .map(|l| {
                    let prefix = if l.flow { "flow " } else { "" };
                    let prefix = if l.stream { "stream " } else { prefix };
                    format!("{prefix}`{}{}`", l.path, sizes(l))
                })
                .collect();
            texts.join(", ")
        };
        let (p, q) = (names(x), names(y));
        let text = |span: Span| self.scopes.table.files.snippet(span).to_string();
        let message = format!("`{}` and `{}` are connectors of different kinds", text(a), text(b));
        let mut diagnostic = Diagnostic::error(Code::ConnectorMismatch, message)
            .at(span, "")
            .with(a, format!("has {p}"))
            .with(b, format!("has {q}"));
        if let Some((why, places)) = self.first_difference((&text(a), x), (&text(b), y)) {
            for place in places {
                diagnostic = diagnostic.with(place, "declared here");
            }
            diagnostic = diagnostic.help(why);
        }
        let diagnostic = self.propose_other_end(diagnostic, [left, right]);
        self.report(diagnostic);
        Fail::Reported
    }

    /// The first element in which two connectors differ, and where it is declared.
    fn first_difference(&self, left: (&str, &[Leaf]), right: (&str, &[Leaf])) -> Option<(String, Vec<Span>)> {
        let of = |leaf: &Leaf| &self.scopes.instances[leaf.inst];
        for ((name, leaves), (other, others)) in [(left, right), (right, left)] {
            for leaf in leaves {
                let path = &leaf.path;
                let Some(same) = others.iter().find(|l| l.path == *path) else {
                    let near = hyd_source::did_you_mean(path, others.iter().map(|l| l.path.as_ref()));
                    let near = near.map(|hint| format!(" ({hint})")).unwrap_or_default();
                    return Some((
                        format!("`{other}` has no element `{path}`{near}, `{name}` has it"),
                        vec![of(leaf).span],
                    ));
                };
                let places = vec![of(leaf).span, of(same).span];
                if leaf.flow != same.flow {
                    let (flow, potential) = if leaf.flow { (name, other) } else { (other, name) };
                    return Some((format!("`{path}` is a flow in `{flow}` and a potential in `{potential}`"), places));
                }
                if leaf.stream != same.stream {
                    let (stream, other) = if leaf.stream { (name, other) } else { (other, name) };
                    return Some((format!("`{path}` is a stream variable in `{stream}`, not in `{other}`"), places));
                }
                if of(leaf).dims != of(same).dims {
                    let sizes = |l: &Leaf| match of(l).dims.as_slice() {
                        [] => "a scalar".to_string(),
                        dims => format!("of size {dims:?}"),
                    };
                    let why = format!("`{path}` is {} in `{name}` and {} in `{other}`", sizes(leaf), sizes(same));
                    return Some((why, places));
                }
                let scalar = |l: &Leaf| of(l).primitive.as_ref().map_or("?", |p| p.scalar.name()).to_string();
                if scalar(leaf) != scalar(same) {
                    let why = format!("`{path}` is {} in `{name}` and {} in `{other}`", scalar(leaf), scalar(same));
                    return Some((why, places));
                }
            }
        }
        None
    }

    /// Reports a set of connected inputs and outputs with more than one source: an output seen from outside its
    /// component, or a public input seen from inside (Modelica 3.6, section 9.3).  With each variable: whether it shows
    /// its outside face, and the connect.
    pub(crate) fn has_two_sources(&mut self, leaves: &[(InstId, bool, Span)], variables: &[(VarId, bool)]) -> bool {
        let mut sources = Vec::new();
        let mut taken = Vec::new();
        for (&(leaf, outside, at), &(v, _)) in leaves.iter().zip(variables) {
            match self.direction_of(leaf) {
                Some(Direction::Output) if !outside => sources.push((v, leaf, at)),
                Some(Direction::Input) if outside && !self.scopes.instances[leaf].protected => {
                    sources.push((v, leaf, at))
                }
                Some(_) => taken.push((v, leaf)),
                None => {}
            }
        }
        let Some(span) = sources.iter().skip(1).map(|&(.., at)| at).max_by_key(|at| (at.file, at.start)) else {
            self.feeds_itself(leaves);
            return false;
        };
        let names: Vec<String> = sources.iter().map(|&(v, ..)| format!("`{}`", self.model.var_name(v))).collect();
        let number = names.len();
        let names = names.join(", ");
        let message = match taken.first() {
            Some(&(v, _)) => {
                format!("`{}` takes one value, but {number} are connected to it: {names}", self.model.var_name(v))
            }
            None => format!("{number} sources are connected to each other: {names}"),
        };
        let mut diagnostic = Diagnostic::error(Code::ConnectorMismatch, message).at(span, "");
        for (_, leaf, _) in sources {
            let declared = self.scopes.instances[leaf].span;
            if diagnostic.labels.iter().all(|label| label.span != declared) {
                diagnostic = diagnostic.with(declared, "gives a value");
            }
        }
        diagnostic = diagnostic.help("an output may go to several inputs, but an input takes one output");
        // A component with several inputs may have got at one what was meant for another.
        let others = taken.first().map_or_else(Vec::new, |&(_, leaf)| self.other_inputs(leaf));
        if !others.is_empty() {
            let shown = &others[..others.len().min(MOST_OTHERS)];
            diagnostic =
                diagnostic.help(format!("perhaps one of them is meant for another input there: {}", shown.join(", ")));
        }
        self.report(diagnostic);
        true
    }

    /// Names of the other inputs of the component that has an input.
    fn other_inputs(&mut self, leaf: InstId) -> Vec<String> {
        let instances = &self.scopes.instances;
        let Some(component) = instances[leaf].parent else { return Vec::new() };
        let mut all: Vec<InstId> = instances[component].by_name.values().copied().collect();
        all.sort_unstable();
        let is_other = |&inst: &InstId| {
            inst != leaf
                && instances[inst].parent == Some(component)
                && self.direction_of(inst) == Some(Direction::Input)
        };
        all.retain(is_other);
        all.into_iter().map(|inst| format!("`{}`", self.path(inst))).collect()
    }

    /// `input` or `output` of a variable in a connector, its own or that of what it is part of.
    pub(crate) fn direction_of(&self, leaf: InstId) -> Option<Direction> {
        let mut at = leaf;
        loop {
            let instance = &self.scopes.instances[at];
            if instance.direction.is_some() {
                return instance.direction;
            }
            at = instance.parent.filter(|&p| self.scopes.instances[p].kind == ClassKind::Connector)?;
        }
    }
}
