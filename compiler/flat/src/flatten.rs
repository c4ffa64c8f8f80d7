//! The flattener: instances to variables, bindings and equations.
//!
//! Order: variables of all instances, then their bindings and start values, then the equation sections, then connections, and
//! at the end the values from outside that all this has asked for.

use std::sync::Arc;

use hyd_instance::{InstId, InstanceTree, Scope};
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{BodyId, NodeId};
use hyd_syntax::tree::ClassKind;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::body::{Builder, KnownBody};
use crate::connect::Connections;
use crate::context::{Context, Fail};
use crate::emit::Canonical;
use crate::index::{Affine, CounterId, Cut, Slots, Window};
use crate::inject::{Injection, Pending};
use crate::jump::JumpKey;
use crate::model::{BlockId, ConstId, FlatModel, VarId};
use crate::unit_claim::FunctionUnits;

/// Work in progress.
pub struct Flattener<'t, 's> {
    pub(crate) tree: &'t mut InstanceTree<'s>,
    pub(crate) model: FlatModel,
    /// Block of each variable instance.
    pub(crate) blocks: FxHashMap<InstId, BlockId>,
    pub(crate) slots: Slots,
    /// Arrays of components whose subscripts around the text were asked for in the call being made.
    pub(crate) asked: Vec<InstId>,
    /// Statements run symbolically for the equation being lowered.
    pub(crate) statements: u32,
    pub(crate) connections: Connections,
    pub(crate) whens: u32,
    /// Folds taken apart so far.
    pub(crate) folds: u32,
    /// Variables made for derivatives that are differentiated.
    pub(crate) rates: FxHashMap<VarId, VarId>,
    /// Expressions being worked on, one within the other, those of called functions within those of the caller.
    pub(crate) lowering: usize,
    /// Expressions lowered for this equation so far, and operands of all equations.
    pub(crate) lowered: u64,
    pub(crate) operands: u64,
    /// Where a `when` sets a whole variable.
    pub(crate) set_in_when: FxHashMap<InstId, Span>,
    /// Samples made so far: the variable that says when they are due.
    pub(crate) samples: FxHashMap<(InstId, Span, Vec<i64>), VarId>,
    /// Integers with events at their jumps: the variable of each.
    pub(crate) jumps: Vec<(JumpKey, VarId)>,
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
    /// Equations whose values must be discrete-time expressions.
    pub(crate) discrete_equations: Vec<usize>,
    /// Functions whose names have been looked at because a call failed.
    pub(crate) looked_at: FxHashSet<InstId>,
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

/// Lengths of the tables of the model, and of the messages of the tree.
#[derive(PartialEq)]
pub(crate) struct Mark {
    variables: usize,
    scalars: u32,
    equations: usize,
    delays: usize,
    messages: usize,
    pub claims: usize,
    said: usize,
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
    let root = tree.root;
    let class = tree.instances[root].class;
    let name: Arc<str> = class.map(|c| tree.table.full_name(c)).unwrap_or_default().into();
    let span = tree.instances[root].span;
    let mut flattener = Flattener {
        model: FlatModel { name, description: tree.instances[root].description.clone(), ..FlatModel::default() },
        tree,
        blocks: FxHashMap::default(),
        slots: Slots::default(),
        asked: Vec::new(),
        statements: 0,
        connections: Connections::default(),
        whens: 0,
        folds: 0,
        rates: FxHashMap::default(),
        lowering: 0,
        lowered: 0,
        operands: 0,
        set_in_when: FxHashMap::default(),
        samples: FxHashMap::default(),
        jumps: Vec::new(),
        late: FxHashMap::default(),
        builders: Vec::new(),
        bodies: Vec::new(),
        opaque_at: span,
        injections: Vec::new(),
        quantities: FxHashMap::default(),
        discrete_equations: Vec::new(),
        looked_at: FxHashSet::default(),
        function_units: FxHashMap::default(),
        is_component: false,
        range_checks: FxHashMap::default(),
        numbers: FxHashMap::default(),
        canonical: FxHashMap::default(),
        driven: driven.to_vec(),
        driven_instances: Vec::new(),
        paths: FxHashMap::default(),
    };
    flattener.read_experiment();
    flattener.prepare_injections(terms);
    flattener.settle_inputs_of_the_model();
    flattener.declare(root);
    flattener.note_ends();
    flattener.drive_inputs();
    let variables: Vec<InstId> = flattener.variable_instances();
    for &inst in &variables {
        flattener.attributes(inst);
        flattener.bind(inst);
    }
    let bindings = flattener.model.equations.len();
    flattener.sections(root);
    flattener.check_injections();
    let sections = flattener.model.equations.len();
    flattener.connect_all();
    flattener.check_ends();
    flattener.balance_components(bindings, sections);
    flattener.check_discrete_time();
    flattener.take_given_values();
    flattener.settle();
    flattener.model
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
        let mark = self.tree.table.diagnostics.len();
        let made = self.mark();
        match body(self, &mut cx) {
            Ok(()) | Err(Fail::Reported | Fail::Opaque) => {}
            Err(Fail::NeedsExpansion) => {
                self.tree.table.diagnostics.truncate(mark);
                self.take_back(&made);
                self.expand(&start, Vec::new(), body);
            }
            Err(Fail::Split(counter, cut)) => {
                self.tree.table.diagnostics.truncate(mark);
                self.take_back(&made);
                for next in parts(&start, &cx, counter, cut) {
                    self.with_counters(next, body);
                    if self.tree.table.diagnostics.len() > mark {
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
        let errors = self.tree.table.diagnostics.len();
        let mut cx = Context { fixed: Some(fixed.clone()), ..start.clone() };
        // Calls are made once for all values: their slots stay.
        if self.slots.calls.is_empty() {
            self.begin_slots();
        }
        let made = self.mark();
        match body(self, &mut cx) {
            Ok(()) | Err(Fail::Reported | Fail::Opaque) => {}
            Err(Fail::NeedsExpansion) => {
                self.tree.table.diagnostics.truncate(errors);
                self.take_back(&made);
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
                    if self.tree.table.diagnostics.len() > errors {
                        return;
                    }
                }
            }
            Err(Fail::Split(counter, cut)) => {
                self.tree.table.diagnostics.truncate(errors);
                self.take_back(&made);
                for next in parts(start, &cx, counter, cut) {
                    self.expand(&next, fixed.clone(), body);
                    if self.tree.table.diagnostics.len() > errors {
                        return;
                    }
                }
            }
        }
    }

    /// What there is before an attempt.
    pub(crate) fn mark(&self) -> Mark {
        Mark {
            variables: self.model.variables.len(),
            scalars: self.model.scalars,
            equations: self.model.equations.len(),
            delays: self.model.delays.len(),
            messages: self.model.messages.len(),
            claims: self.model.claims.len(),
            said: self.tree.table.diagnostics.len(),
        }
    }

    /// Takes back what an attempt has made beside its own equation (delays, samples).
    fn take_back(&mut self, made: &Mark) {
        self.model.variables.raw.truncate(made.variables);
        self.model.scalars = made.scalars;
        self.model.equations.truncate(made.equations);
        self.model.delays.truncate(made.delays);
        self.model.messages.truncate(made.messages);
        self.model.claims.truncate(made.claims);
        self.discrete_equations.retain(|&at| at < made.equations);
        self.samples.retain(|_, due| due.0 < made.scalars);
        self.jumps.retain(|(_, whole)| whole.0 < made.scalars);
        self.rates.retain(|_, rate| rate.0 < made.scalars);
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

/// Sizes for messages: `[3, 4]`, `scalar`.
pub(crate) fn sizes_text(sizes: &[usize]) -> String {
    if sizes.is_empty() { "scalar".into() } else { format!("{sizes:?}") }
}
