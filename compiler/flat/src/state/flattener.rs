//! The flattener: work in progress, and the loops around what is lowered.

use std::rc::Rc;
use std::sync::Arc;

use hyd_instance::external::{Object, TableFunction};
use hyd_instance::{InstId, InstanceTree, Scope, Scopes};
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{BodyId, NodeId};
use hyd_syntax::tree::Name;
use hyd_typed::{Expr, Typing};
use rustc_hash::FxHashMap;

use crate::connections::connect::Connections;
use crate::connections::equality_constraints::Record;
use crate::connections::foreign_blocks::Found;
use crate::connections::virtual_graph::VirtualGraph;
use crate::functions::draw::Place;
use crate::model::{BlockId, ConstId, FlatModel, VarId};
use crate::sections::inject::Pending;
use crate::state::context::{Context, Fail, Local};
use crate::state::draft::{Draft, Notes};
use crate::state::emit::Canonical;
use crate::state::index::{Affine, CounterId, Cut, Slots, Window};
use crate::state::steps::{Builder, KnownBody};
use crate::state::unit_claim::FunctionUnits;

/// Stands for the names of all inputs of the model itself that can follow samples, see [`crate::flatten`].
pub const EVERY_INPUT: &str = "*";

/// The outputs of a call in their order.
pub(crate) type Outputs = Vec<(Name, Local)>;

/// A function of the run that was made of a table: the table, what is asked of it, its output, derivatives by its arguments.
pub(crate) type KnownTable = (Arc<Object>, TableFunction, usize, [u32; 2]);

/// All outputs of a call.
pub(crate) type Functions<'t, 's> = fn(&mut Flattener<'t, 's>, &Expr, &mut Context) -> Result<Outputs, Fail>;

/// What is read of equation sections: all connections of the model stand before all else.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Pass {
    /// `connect`, and the loops and conditions around it.
    Connections,
    /// Everything else.
    Equations,
}

/// Work in progress.
pub(crate) struct Flattener<'t, 's> {
    /// The components of the model, which stay as they are.
    pub(crate) tree: &'t InstanceTree,
    /// What names in their texts mean.
    pub(crate) scopes: &'t mut Scopes<'s>,
    pub(crate) model: FlatModel,
    /// Block of each variable instance.
    pub(crate) blocks: FxHashMap<InstId, BlockId>,
    /// For each stream variable the first of the variables that `inStream` means.
    pub(crate) in_streams: FxHashMap<InstId, VarId>,
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
    /// What is said of overdetermined records.
    pub(crate) graph: VirtualGraph,
    /// The overdetermined records of connectors, as far as asked.
    pub(crate) records: FxHashMap<InstId, Rc<[Record]>>,
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
    /// What is read of the sections now.
    pub(crate) pass: Pass,
    /// In a `when` of clocks: the first of them and how many there are.
    pub(crate) clock_around: Option<(VarId, u32)>,
    /// Functions made of tables.
    pub(crate) tables_known: Vec<(KnownTable, BodyId)>,
    /// Functions made of lists of numbers, by the bits of these.
    pub(crate) lists_known: FxHashMap<Vec<u64>, BodyId>,
    pub(crate) numbers: FxHashMap<u64, ConstId>,
    /// Templates made so far, by the sides they were made from.
    pub(crate) canonical: FxHashMap<(NodeId, NodeId), Canonical>,
    /// Names of inputs of the model itself that follow recorded samples, and what they are.
    pub(crate) driven: Vec<String>,
    pub(crate) driven_instances: Vec<InstId>,
    /// Units of other tools, until their variables are declared.
    pub(crate) foreign: Vec<Found>,
    /// Who runs or compiles the functions that expressions call.
    pub(crate) functions: Functions<'t, 's>,
    /// What has been typed.
    pub(crate) typing: Typing,
    pub(crate) paths: FxHashMap<InstId, Arc<str>>,
    /// How often each place that draws random numbers was met for the equation being lowered.
    pub(crate) draws_met: FxHashMap<Place, u32>,
    /// Random numbers asked for.
    pub(crate) drawn: u64,
}

impl Flattener<'_, '_> {
    pub(crate) fn report(&mut self, diagnostic: Diagnostic) {
        self.scopes.table.report(diagnostic);
    }

    /// Whether the model becomes a unit, whose inputs are all given from outside.
    pub(crate) fn is_for_other_tools(&self) -> bool {
        self.driven.iter().any(|name| name == EVERY_INPUT)
    }

    pub(crate) fn error(&mut self, code: Code, span: Span, message: impl Into<String>) -> Fail {
        self.report(Diagnostic::error(code, message).at(span, ""));
        Fail::Reported
    }

    /// Says that what stands here is an array.
    pub(crate) fn no_scalar(&mut self, span: Span) -> Fail {
        self.error(Code::ArrayShape, span, "an array stands where a scalar is needed")
    }

    /// Says why something has no meaning.
    pub(crate) fn say(&mut self, said: &[Diagnostic]) -> Fail {
        said.iter().for_each(|diagnostic| self.report(diagnostic.clone()));
        Fail::Reported
    }

    /// Instance path for origins.
    pub(crate) fn path(&mut self, inst: InstId) -> Arc<str> {
        if let Some(known) = self.paths.get(&inst) {
            return known.clone();
        }
        let path: Arc<str> = hyd_instance::instance::path(&self.scopes.instances, inst).into();
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
    pub(crate) fn with_counters(
        &mut self,
        start: Context,
        body: &mut dyn FnMut(&mut Self, &mut Context) -> Result<(), Fail>,
    ) {
        self.begin_slots();
        self.draws_met.clear();
        let mut cx = start.clone();
        let said = self.scopes.table.messages.count();
        match self.attempt(|flat| body(flat, &mut cx)) {
            (Ok(()) | Err(Fail::Reported | Fail::Opaque), draft) => self.keep(draft),
            (Err(Fail::NeedsExpansion), _) => self.expand(&start, Vec::new(), body),
            (Err(Fail::Split(counter, cut)), _) => {
                for next in parts(&start, &cx, counter, cut) {
                    self.with_counters(next, body);
                    if self.scopes.table.messages.count() > said {
                        return;
                    }
                }
            }
        }
    }

    /// Fixes one counter after the other; a counter shows itself when `body` asks for it.
    pub(crate) fn expand(
        &mut self,
        start: &Context,
        fixed: Vec<i64>,
        body: &mut dyn FnMut(&mut Self, &mut Context) -> Result<(), Fail>,
    ) {
        let said = self.scopes.table.messages.count();
        let mut cx = Context { fixed: Some(fixed.clone()), ..start.clone() };
        // Calls are made once for all values: their slots stay.
        if self.slots.calls.is_empty() {
            self.begin_slots();
        }
        self.draws_met.clear();
        match self.attempt(|flat| body(flat, &mut cx)) {
            (Ok(()) | Err(Fail::Reported | Fail::Opaque), draft) => self.keep(draft),
            (Err(Fail::NeedsExpansion), _) => {
                if fixed.len() == cx.counts.len() {
                    let span = self.scopes.instances[start.scope.inst].span;
                    let _ = self.error(Code::NotStructural, span, "a subscript here cannot be computed before the run");
                    return;
                }
                let window = cx.window(CounterId(fixed.len() as u32));
                for k in 0..window.count as i64 {
                    let mut next = fixed.clone();
                    next.push(window.first + window.stride * k);
                    self.expand(start, next, body);
                    if self.scopes.table.messages.count() > said {
                        return;
                    }
                }
            }
            (Err(Fail::Split(counter, cut)), _) => {
                for next in parts(start, &cx, counter, cut) {
                    self.expand(&next, fixed.clone(), body);
                    if self.scopes.table.messages.count() > said {
                        return;
                    }
                }
            }
        }
    }

    /// The surroundings of the equations of an instance: its arrays of components as counters.
    pub(crate) fn context_of(&mut self, scope: Scope) -> Context {
        Context::new(scope)
    }

    /// Adds the counters of the arrays of components around the scope (call first inside `with_loops`).
    pub(crate) fn enter(&mut self, cx: &mut Context) {
        for id in hyd_instance::instance::chain(&self.scopes.instances, cx.scope.inst) {
            let dims = self.scopes.instances[id].dims.clone();
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
