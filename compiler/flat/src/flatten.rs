//! The flattener: instances to variables, bindings and equations.
//!
//! Order: variables of all instances, then their bindings and start values, then the equation sections, then connections, and
//! at the end the values from outside that all this has asked for.

use std::sync::Arc;

use hyd_instance::{InstId, InstanceTree, Scope};
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{BodyId, NodeId};
use hyd_syntax::tree::ClassKind;
use rustc_hash::FxHashMap;

use crate::body::{Builder, KnownBody};
use crate::connect::Connections;
use crate::context::{Context, Fail};
use crate::draft::{Draft, Notes};
use crate::emit::Canonical;
use crate::index::{Affine, CounterId, Cut, Slots, Window};
use crate::inject::{Injection, Pending};
use crate::model::{BlockId, ConstId, FlatModel};
use crate::unit_claim::FunctionUnits;

/// Work in progress.
pub(crate) struct Flattener<'t, 's> {
    pub(crate) tree: &'t mut InstanceTree<'s>,
    pub(crate) model: FlatModel,
    /// Block of each variable instance.
    pub(crate) blocks: FxHashMap<InstId, BlockId>,
    /// What the equations so far leave for others to know.
    pub(crate) notes: Notes,
    /// Open attempts, one within the other.
    pub(crate) drafts: Vec<Draft>,
    pub(crate) slots: Slots,
    /// Arrays of components whose subscripts around the text were asked for in the call being made.
    pub(crate) asked: Vec<InstId>,
    /// Statements run symbolically for the equation being lowered.
    pub(crate) statements: u32,
    pub(crate) connections: Connections,
    /// Expressions being worked on, one within the other, those of called functions within those of the caller.
    pub(crate) lowering: usize,
    /// Expressions lowered for this equation so far.
    pub(crate) lowered: u64,
    /// Equations need more operands than there may be, and that has been said.
    pub(crate) too_many_operands: bool,
    /// Whether a parameter waits for the start, as far as asked.
    pub(crate) late: FxHashMap<InstId, bool>,
    /// Functions that are being compiled, innermost last, and those that were.
    pub(crate) builders: Vec<Builder>,
    pub(crate) bodies: Vec<KnownBody>,
    /// Why the last function could not be run symbolically.
    pub(crate) opaque_at: Span,
    /// Terms to be added to equations.
    pub(crate) injections: Vec<Pending>,
    /// Numbers with units made so far.
    pub(crate) quantities: FxHashMap<(Span, u64, Arc<str>), ConstId>,
    /// Units that functions declare.
    pub(crate) function_units: FxHashMap<InstId, FunctionUnits>,
    /// It has physical connectors on its outside, so that it needs a model around it.
    pub(crate) is_component: bool,
    /// Functions that check integers, by the text that computes them.
    pub(crate) range_checks: FxHashMap<Span, BodyId>,
    pub(crate) numbers: FxHashMap<u64, ConstId>,
    /// Templates made so far, by the sides they were made from.
    pub(crate) canonical: FxHashMap<(NodeId, NodeId), Canonical>,
    /// Names of inputs of the model itself that follow recorded samples, and what they are.
    pub(crate) driven: Vec<String>,
    pub(crate) driven_instances: Vec<InstId>,
    paths: FxHashMap<InstId, Arc<str>>,
}

/// Turns the instance tree into a flat model.  Messages go into the tree's table; the model is as complete as it could be.
pub fn flatten(tree: &mut InstanceTree<'_>) -> FlatModel {
    flatten_with(tree, &[])
}

/// The same with terms added to equations.
pub fn flatten_with(tree: &mut InstanceTree<'_>, terms: &[Injection]) -> FlatModel {
    flatten_driven(tree, terms, &[])
}

/// The same where inputs of the model itself, given by their names, follow recorded samples.  What is not the name of an input of type
/// Real stays without effect; [`FlatModel::driven`] says which there are.
pub fn flatten_driven(tree: &mut InstanceTree<'_>, terms: &[Injection], driven: &[String]) -> FlatModel {
    Flattener::new(tree, driven).model_of(terms, |_| {})
}

impl<'t, 's> Flattener<'t, 's> {
    fn new(tree: &'t mut InstanceTree<'s>, driven: &[String]) -> Self {
        let root = tree.root;
        let class = tree.instances[root].class;
        let name: Arc<str> = class.map(|c| tree.table.full_name(c)).unwrap_or_default().into();
        let span = tree.instances[root].span;
        Flattener {
            model: FlatModel { name, description: tree.instances[root].description.clone(), ..FlatModel::default() },
            tree,
            blocks: FxHashMap::default(),
            notes: Notes::default(),
            drafts: Vec::new(),
            slots: Slots::default(),
            asked: Vec::new(),
            statements: 0,
            connections: Connections::default(),
            lowering: 0,
            lowered: 0,
            too_many_operands: false,
            late: FxHashMap::default(),
            builders: Vec::new(),
            bodies: Vec::new(),
            opaque_at: span,
            injections: Vec::new(),
            quantities: FxHashMap::default(),
            function_units: FxHashMap::default(),
            is_component: false,
            range_checks: FxHashMap::default(),
            numbers: FxHashMap::default(),
            canonical: FxHashMap::default(),
            driven: driven.to_vec(),
            driven_instances: Vec::new(),
            paths: FxHashMap::default(),
        }
    }

    /// The flat model; `before_sections` is called when variables and bindings are there.
    fn model_of(mut self, terms: &[Injection], before_sections: impl FnOnce(&mut Self)) -> FlatModel {
        self.read_experiment();
        self.prepare_injections(terms);
        self.settle_inputs_of_the_model();
        let root = self.tree.root;
        self.declare(root);
        self.note_ends();
        self.drive_inputs();
        let variables: Vec<InstId> = self.variable_instances();
        for &inst in &variables {
            self.attributes(inst);
            self.bind(inst);
        }
        let bindings = self.model.equations.len();
        before_sections(&mut self);
        self.sections(root);
        self.check_injections();
        let sections = self.model.equations.len();
        self.connect_all();
        self.check_ends();
        self.balance_components(bindings, sections);
        self.check_discrete_time();
        self.take_given_values();
        self.settle();
        let injectable = self.notes.injectable.iter().map(|&at| at as u32).collect();
        FlatModel { injectable, ..self.model }
    }
}

impl Flattener<'_, '_> {
    pub(crate) fn report(&mut self, diagnostic: Diagnostic) {
        self.tree.table.report(diagnostic);
    }

    pub(crate) fn error(&mut self, code: Code, span: Span, message: impl Into<String>) -> Fail {
        self.report(Diagnostic::error(code, message).at(span, ""));
        Fail::Reported
    }

    /// Instance path for origins.
    pub(crate) fn path(&mut self, inst: InstId) -> Arc<str> {
        if let Some(known) = self.paths.get(&inst) {
            return known.clone();
        }
        let path: Arc<str> = hyd_instance::instance::path(&self.tree.instances, inst).into();
        self.paths.insert(inst, path.clone());
        path
    }

    pub(crate) fn variable_instances(&self) -> Vec<InstId> {
        let mut list: Vec<(BlockId, InstId)> = self.blocks.iter().map(|(&inst, &block)| (block, inst)).collect();
        list.sort_unstable();
        list.into_iter().map(|(_, inst)| inst).collect()
    }

    /// Runs `body` with symbolic counters, as [`Self::with_counters`] does: an equation, or what is like one.
    pub(crate) fn with_loops(
        &mut self,
        start: Context,
        body: &mut dyn FnMut(&mut Self, &mut Context) -> Result<(), Fail>,
    ) {
        self.lowered = 0;
        self.with_counters(start, body);
    }

    /// Runs `body` with symbolic counters; where that fails for a subscript or condition, once for every part of the values of a
    /// counter or for every value.
    fn with_counters(&mut self, start: Context, body: &mut dyn FnMut(&mut Self, &mut Context) -> Result<(), Fail>) {
        self.begin_slots();
        let mut cx = start.clone();
        let said = self.tree.table.messages.count();
        match self.attempt(|flat| body(flat, &mut cx)) {
            (Ok(()) | Err(Fail::Reported | Fail::Opaque), draft) => self.keep(draft),
            (Err(Fail::NeedsExpansion), _) => self.expand(&start, Vec::new(), body),
            (Err(Fail::Split(counter, cut)), _) => {
                for next in parts(&start, &cx, counter, cut) {
                    self.with_counters(next, body);
                    if self.tree.table.messages.count() > said {
                        return;
                    }
                }
            }
        }
    }

    /// Fixes one counter after the other; a counter shows itself when `body` asks for it.
    fn expand(
        &mut self,
        start: &Context,
        fixed: Vec<i64>,
        body: &mut dyn FnMut(&mut Self, &mut Context) -> Result<(), Fail>,
    ) {
        let said = self.tree.table.messages.count();
        let mut cx = Context { fixed: Some(fixed.clone()), ..start.clone() };
        // Calls are made once for all values: their slots stay.
        if self.slots.calls.is_empty() {
            self.begin_slots();
        }
        match self.attempt(|flat| body(flat, &mut cx)) {
            (Ok(()) | Err(Fail::Reported | Fail::Opaque), draft) => self.keep(draft),
            (Err(Fail::NeedsExpansion), _) => {
                if fixed.len() == cx.counts.len() {
                    let span = self.tree.instances[start.scope.inst].span;
                    let _ = self.error(Code::NotStructural, span, "a subscript here cannot be computed before the run");
                    return;
                }
                let window = cx.window(CounterId(fixed.len() as u32));
                for k in 0..window.count as i64 {
                    let mut next = fixed.clone();
                    next.push(window.first + window.stride * k);
                    self.expand(start, next, body);
                    if self.tree.table.messages.count() > said {
                        return;
                    }
                }
            }
            (Err(Fail::Split(counter, cut)), _) => {
                for next in parts(start, &cx, counter, cut) {
                    self.expand(&next, fixed.clone(), body);
                    if self.tree.table.messages.count() > said {
                        return;
                    }
                }
            }
        }
    }

    fn read_experiment(&mut self) {
        let Some(class) = self.tree.instances[self.tree.root].class else { return };
        let def = self.tree.table.class(class).def.clone();
        let Some(annotation) = &def.annotation else { return };
        let tree = hyd_instance::modifier::AstMod::from_syntax(annotation);
        let Some((_, experiment)) = tree.children.iter().find(|(n, _)| n.as_ref() == "experiment") else { return };
        let scope = Scope { inst: self.tree.root, frame: 0 };
        for (name, entry) in &experiment.children {
            let Some(expr) = &entry.binding else { continue };
            let Ok(value) = self.tree.evaluate(expr, scope, &hyd_instance::Env::default()) else { continue };
            let Some(number) = value.as_real().filter(|x| x.is_finite()) else { continue };
            match name.as_ref() {
                "StartTime" => self.model.experiment.start = Some(number),
                "StopTime" => self.model.experiment.stop = Some(number),
                "Tolerance" => self.model.experiment.tolerance = Some(number),
                "Interval" => self.model.experiment.interval = Some(number),
                _ => {}
            }
        }
    }

    /// Equation sections of an instance and all below it.
    fn sections(&mut self, inst: InstId) {
        if self.tree.instances[inst].absent {
            return;
        }
        if let (Some(shape), false) =
            (self.tree.instances[inst].shape.clone(), self.tree.instances[inst].kind == ClassKind::Package)
        {
            for frame in 0..shape.frames.len() {
                let def = shape.def(&self.tree.table, frame as u32).clone();
                self.class_sections(Scope { inst, frame: frame as u32 }, &def);
            }
        }
        for child in self.tree.instances[inst].children.clone() {
            self.sections(child);
        }
    }

    /// The surroundings of the equations of an instance: its arrays of components as counters.
    pub(crate) fn context_of(&mut self, scope: Scope) -> Context {
        Context::new(scope)
    }

    /// Adds the counters of the arrays of components around the scope (call first inside `with_loops`).
    pub(crate) fn enter(&mut self, cx: &mut Context) {
        for id in hyd_instance::instance::chain(&self.tree.instances, cx.scope.inst) {
            let dims = self.tree.instances[id].dims.clone();
            if !dims.is_empty() {
                let own = dims.iter().map(|&d| cx.counter(d)).collect();
                cx.implicit.push((id, own));
            }
        }
    }
}

/// The surroundings `start` for each part of the values of a counter that `cx` was found to need.
fn parts(start: &Context, cx: &Context, counter: CounterId, cut: Cut) -> Vec<Context> {
    let with = |part: Window| {
        let mut next = Context { cuts_left: start.cuts_left.saturating_sub(1), ..start.clone() };
        next.windows.retain(|window| window.counter != counter);
        next.windows.push(part);
        next
    };
    cx.window(counter).parts(cut).into_iter().map(with).collect()
}

/// `affine * size`
pub(crate) fn scale(affine: &Affine, size: usize) -> Affine {
    Affine {
        constant: affine.constant * size as i64,
        terms: affine.terms.iter().map(|&(id, c)| (id, c * size as i64)).filter(|(_, c)| *c != 0).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inject::TermShape;
    use hyd_instance::{ClassTable, SourceText, Sources};

    struct NoLibraries;

    impl Sources for NoLibraries {
        fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    const TEXTS: [&str; 4] = [
        "model M Real x[9](each start = 1, each fixed = true); Real y[3]; Real z[2]; discrete Integer n(start = 0);
        equation der(x) = -x;
        for k in 1:3 loop y[k] = delay(x[k*k], 0.1) + floor(3*x[k]); end for;
        for k in 1:2 loop z[k] = if k > 1 then (if sample(0, k) then 1 else 2) else der(y[k]); end for;
        when x[1] < 0.5 then n = pre(n) + 1; end when;
        assert(x[1] > 0, \"below zero\"); end M;",
        "function f input Real u(unit = \"m\"); output Real y[3]; algorithm for k in 1:3 loop y[k] := k*u; end for; end f;
        model M Real x(unit = \"m\") = 2*time; Real y[3] = f(x); Real s; Real w[50];
        equation w = fill(time, 50); s = sum(w[k]^2 for k in 1:50); end M;",
        "model M Real x(start = 1, fixed = true); Boolean b; discrete Real h;
        equation der(x) = if b then -x else sin(time); b = x > 0.5;
        when {b, time > 2} then h = x; reinit(x, 1); end when; end M;",
        "model M Real x; Real y[2];
        equation x = unknown + 1; y[3] = f(2); when x > 1 then y[1] = x; end when; when x > 2 then y[1] = x; end when; end M;",
    ];

    fn shown(text: &str, rehearse: bool) -> String {
        let mut sources = NoLibraries;
        let mut table = ClassTable::new(&mut sources);
        let class = *table.add_main("m.hyd", text).last().expect("a class");
        let mut tree = hyd_instance::instantiate(table, class, Vec::new()).ok().expect("it can be instantiated");
        let shape = TermShape::Expression("x[if true then 1 else 2]".into());
        let term = Injection { path: "".into(), file: None, line: 2, name: "extra".into(), shape };
        let model = Flattener::new(&mut tree, &[]).model_of(&[term], |flat| {
            if rehearse {
                flat.quietly(|flat| flat.sections(flat.tree.root));
            }
        });
        let FlatModel { variables, equations, delays, messages, claims, injectable, scalars, .. } = &model;
        let made = format!("{variables:#?}{equations:#?}{delays:?}{messages:?}{claims:#?}{injectable:?}{scalars}");
        format!("{made}{:?}{:#?}", model.constants, tree.table.messages.into_given())
    }

    /// All sections, lowered as an attempt that is dropped before they are lowered for good, change nothing: no variable, no
    /// equation, no number, no message.
    #[test]
    fn a_dropped_attempt_leaves_no_trace() {
        for text in TEXTS {
            let (once, rehearsed) = (shown(text, false), shown(text, true));
            for (a, b) in once.lines().zip(rehearsed.lines()) {
                assert_eq!(a, b, "{text}");
            }
            assert_eq!(once.len(), rehearsed.len());
        }
    }
}
