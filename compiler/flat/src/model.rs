//! The flat model: variables and equations without components, arrays kept as blocks.
//!
//! Scalar variables are numbered through ([`VarId`]); the elements of an array are neighbours and share one
//! [`VariableBlock`].  Equations come in [`EquationBlock`]s: one template and, per equation, one [`Operand`] for each of
//! its slots, so the equations of a `for` loop or of an array of components share code and memory stays a few words each.
//! Nothing is solved, sorted or eliminated here.

use std::collections::BTreeSet;
use std::sync::Arc;

use hyd_index::{IndexVec, TypedIndex, typed_index};
use hyd_source::{Origin, Span};
use hyd_symbolic::{BodyId, TemplateId, Templates};
use hyd_system::{MemberKind, NamePattern, Settable, TextFormat, ValueKind, Variability};

use crate::state::made::Made;

pub use crate::operand::{Operand, Target};

typed_index!(
    /// A scalar variable, parameter or constant.
    VarId,
    "v"
);
typed_index!(
    /// A variable block.
    BlockId,
    "b"
);
typed_index!(
    /// A number that stands in a slot.
    ConstId,
    "c"
);

/// An attribute of all elements of a block.
#[derive(Clone, PartialEq, Debug)]
pub enum PerElement<T> {
    /// The same for all.
    All(T),
    /// One per element.
    Each(Vec<T>),
}

impl<T: Clone> PerElement<T> {
    /// The attribute of element `k`.
    pub fn get(&self, k: usize) -> T {
        match self {
            PerElement::All(value) => value.clone(),
            PerElement::Each(values) => values[k].clone(),
        }
    }
}

/// The `stateSelect` attribute.
#[derive(Clone, Copy, PartialEq, Eq, Debug, PartialOrd, Ord)]
pub enum StateSelect {
    /// Never a state.
    Never,
    /// Rather not.
    Avoid,
    /// As the tool likes.
    Default,
    /// Rather.
    Prefer,
    /// Always.
    Always,
}

/// The type of a variable as its declaration names it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DeclaredType {
    /// Full name of the class; `None` for the predefined types.
    pub class: Option<Arc<str>>,
    /// The `quantity` attribute.
    pub quantity: Option<Arc<str>>,
    /// Descriptions of the literals of an enumeration, empty where there are none.
    pub literals: Vec<Arc<str>>,
}

/// A variable with all its elements.
#[derive(Clone, PartialEq, Debug)]
pub struct VariableBlock {
    /// Name with subscripts.
    pub name: NamePattern,
    /// First element; the others follow.
    pub first: VarId,
    /// Number of elements (0 for an empty array).
    pub count: u32,
    /// Type.
    pub kind: ValueKind,
    /// What the declaration says beyond that; `None` if it says no more.
    pub declared: Option<Arc<DeclaredType>>,
    /// When it may change: declared, or following from its type and its `when`.
    pub variability: Variability,
    /// Unit string, `None` if not stated; that of the first element where they differ.
    pub unit: Option<Arc<str>>,
    /// Unit strings of the elements where they differ (`unit = {"m", "s"}`), else empty.
    pub element_units: Vec<Arc<str>>,
    /// Display unit.
    pub display_unit: Option<Arc<str>>,
    /// Description string.
    pub description: Option<Arc<str>>,
    /// Can it be set on the translated model?
    pub settable: Settable,
    /// Declared in a protected section.
    pub protected: bool,
    /// What the translation made it for; `None` for what is declared.
    pub made: Option<Made>,
    /// A start value was written (a `Start` equation exists).
    pub has_start: bool,
    /// The `fixed` attribute, default filled in (parameters and constants true, others false).
    pub fixed: PerElement<bool>,
    /// The `min` attribute.
    pub min: PerElement<f64>,
    /// The `max` attribute.
    pub max: PerElement<f64>,
    /// Where `min` and `max` are stated.
    pub limit_spans: [Option<Span>; 2],
    /// A number of a record that is not Real and yet follows from continuous values, which changes at any time.
    pub at_any_time: bool,
    /// The `nominal` attribute, `None` if not stated.
    pub nominal: PerElement<Option<f64>>,
    /// The `stateSelect` attribute.
    pub state_select: PerElement<StateSelect>,
    /// Instance path and text of the declaration.
    pub origin: Origin,
}

/// What an equation is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, PartialOrd, Ord)]
pub enum Section {
    /// `left = right` at all times; determines continuous unknowns.
    Continuous,
    /// `left = right`, left a discrete variable: evaluated at events.
    Discrete,
    /// Holds at the start only.
    Initial,
    /// Value of a parameter or constant: left is its slot.
    Binding,
    /// Start attribute: left is a slot with `Target::Start`.
    Start,
    /// `left = right` in the simulation only: the derivatives of the candidates that are states (made by index reduction).
    Selection,
    /// Left is a coefficient by which the choice of states is judged; right is unused (made by index reduction).
    Pivot,
    /// At an event: the state in the left slot takes the value on the right (the state itself when not fired).
    Reinit,
    /// `assert(left, ...)`; right holds the values of the message; index into [`FlatModel::messages`].
    Assert(u32),
    /// `assert` in a `when`: it fails at the event at which left is true; right and index as for assertions.
    AssertOnce(u32),
    /// `terminate` when left is true, right as for assertions; index into [`FlatModel::messages`].
    Terminate(u32),
}

/// Equations that share a template and an origin.
#[derive(Clone, PartialEq, Debug)]
pub struct EquationBlock {
    /// What they are for.
    pub section: Section,
    /// They say what a variable is that the translation made, and nobody wrote them.
    pub made: bool,
    /// Their template.
    pub template: TemplateId,
    /// How many.
    pub count: u32,
    /// `count * arity` operands, equation by equation.
    pub operands: Vec<Operand>,
    /// Instance path and text.
    pub origin: Origin,
}

impl EquationBlock {
    /// Operands of equation `k`, given the template's arity.
    pub fn operands_of(&self, k: usize, arity: usize) -> &[Operand] {
        &self.operands[k * arity..(k + 1) * arity]
    }
}

/// A number of the text with a unit: the value of a constant that declares one.
#[derive(Clone, PartialEq, Debug)]
pub struct Quantity {
    /// The number.
    pub id: ConstId,
    /// Its unit string.
    pub unit: Arc<str>,
    /// Name of the constant.
    pub name: Arc<str>,
    /// Where the unit is declared.
    pub declared: Span,
}

/// A value whose unit is declared where no variable of the model stands: an input or output of a function, a field of a
/// constructed record.  Looked at by the unit check only.
#[derive(Clone, PartialEq, Debug)]
pub struct UnitClaim {
    /// `value = 1`, where the 1 is a [`Quantity`] with the unit.
    pub equations: EquationBlock,
    /// What takes the value: "the input `d` of `area`".
    pub what: Arc<str>,
    /// The call in an equation that leads here.
    pub call: Span,
    /// An input or a field: what comes after it cannot fit if this does not.
    pub given: bool,
    /// Its declaration.
    pub declared: Span,
    /// The unit string.
    pub unit: Arc<str>,
}

/// A component that does not bring the equations it must (Modelica 3.6, section 4.7).
#[derive(Clone, PartialEq, Debug)]
pub struct Imbalance {
    /// Its path; empty for the model itself.
    pub component: Arc<str>,
    /// Name of its class.
    pub class: Arc<str>,
    /// Where the class is declared.
    pub declared: Span,
    /// Equations that one such component must bring.
    pub needed: usize,
    /// Equations it brings.
    pub given: usize,
}

/// A potential of a physical connector: not a flow, not an input or output.
#[derive(Clone, PartialEq, Debug)]
pub struct Potential {
    /// The variable.
    pub block: BlockId,
    /// Full name of the class of its connector.
    pub connector: Arc<str>,
    /// How many parts of the variable's name stand behind that of its component: 2 of `r.p.v`.
    pub depth: u32,
    /// Where the component is declared.
    pub declared: Span,
    /// Nothing is connected to an element of its connector.
    pub open: bool,
}

/// A connector of the model itself, or a physical one of its public components.
#[derive(Clone, PartialEq, Debug)]
pub struct Terminal {
    /// Name with subscripts.
    pub name: NamePattern,
    /// Full name of its class.
    pub class: Arc<str>,
    /// Description string.
    pub description: Option<Arc<str>>,
    /// A connector of the model itself, and so one that a model around it can connect.
    pub outside: bool,
    /// Its variables in the order of the text.
    pub members: Vec<(BlockId, MemberKind)>,
}

/// Where a component and an equation can be put into the text of the model itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Gaps {
    /// The first declaration of a component: another one may stand before it.
    pub declaration: Span,
    /// The first equation: another one may stand before it.
    pub equation: Span,
}

/// Delay sites that were made together: site `first + k` delays element `k` of the source.
///
/// The value obeys `value = delayed(source)` while the model runs and `value = source` at the start (Modelica 3.6,
/// section 3.7.4.1).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DelayBlock {
    /// First site.
    pub first: u32,
    /// Number of sites.
    pub count: u32,
    /// What is delayed.
    pub source: VarId,
    /// The delayed value.
    pub value: VarId,
    /// The delay time in s.
    pub time: VarId,
    /// Its upper bound in s, where the delay time varies during the run.
    pub most: Option<VarId>,
}

/// What is said of a clock, of a clocked variable or of two of them (Modelica 3.6, chapter 16); the operators of a call, one
/// per element.  The stage of clocks reads them and leaves none.
#[derive(Clone, PartialEq, Debug)]
pub struct ClockOperator {
    /// What it says.
    pub kind: ClockKind,
    /// Number of elements.
    pub count: u32,
    /// Its value, element by element.
    pub value: VarId,
    /// What it is computed from, element by element.
    pub source: Option<VarId>,
    /// The clocks that the text gives the value, element by element.
    pub clock: Option<VarId>,
    /// Instance path and text.
    pub origin: Origin,
}

/// Kinds of operators of clocks.
#[derive(Clone, PartialEq, Debug)]
pub enum ClockKind {
    /// The value is a clock, and no more is said.
    Clock,
    /// The value ticks so many times in so many seconds: intervals of counter over resolution.
    Exact(u64, u64),
    /// The value ticks at this interval in s.
    Period(f64),
    /// The value ticks where the source, a Boolean, becomes true.
    Condition,
    /// The value ticks as the source does; rates of its variables are integrated by this method.
    Solver(Arc<str>),
    /// The value is what the source was before the tick.
    Sample,
    /// The value is that of the source between its ticks.
    Hold,
    /// The same for a source of any clock.
    NoClock,
    /// `previous` is asked of the value.
    Previous,
    /// One tick for so many of the source; `None` where that follows from the clocks of both.
    Sub(Option<u64>),
    /// So many ticks for one of the source; `None` where that follows from the clocks of both.
    Super(Option<u64>),
    /// Later by a part of the interval of the source.
    Shift(u64, u64),
    /// Earlier by a part of the interval of the source.
    Back(u64, u64),
    /// The value, of the same clock as the source if there is one, is the time since the tick before.
    Interval,
    /// The value, of the same clock as the source if there is one, is true at the first tick.
    FirstTick,
}

/// Elements of an input of the model itself that follow recorded samples: `variable + k` is input `first + k`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DrivenBlock {
    /// First input.
    pub first: u32,
    /// Number of inputs.
    pub count: u32,
    /// The first of the variables.
    pub variable: VarId,
}

/// A piece of the text of a message.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum MessagePart {
    /// Fixed text.
    Text(Arc<str>),
    /// A value of the run, written in this way.
    Value(TextFormat, ValueKind),
}

/// A String parameter or constant with the values of its elements.
#[derive(Clone, Debug)]
pub struct TextBlock {
    /// Its name.
    pub name: NamePattern,
    /// Values in the order of the elements of the name.
    pub values: Vec<Arc<str>>,
    /// Description.
    pub description: Option<Arc<str>>,
    /// A parameter that a text of the model can give another value.
    pub is_open: bool,
}

/// Text of an `assert` or `terminate`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Message {
    /// The user's text, values of the run as they are written.
    pub text: Arc<str>,
    /// The same with the values of the run, which stand on the right side of the equation in their order
    /// ([`Node::Pair`](hyd_symbolic::Node::Pair)); empty if there are none.
    pub parts: Vec<MessagePart>,
    /// Stops the run (level error) or is only reported (level warning).
    pub error: bool,
}

/// Settings of the `experiment` annotation.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Experiment {
    /// Start time in s.
    pub start: Option<f64>,
    /// Stop time in s.
    pub stop: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Output interval in s.
    pub interval: Option<f64>,
}

/// A block that is a unit of another tool: which variables of the model are which of the unit, by their full names.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ForeignBlock {
    /// Its instance path; empty for the model itself.
    pub path: Arc<str>,
    /// The file of the unit, as the text names it.
    pub file: Arc<str>,
    /// The file of that text.
    pub written_in: Arc<str>,
    /// Where the file is named.
    pub span: Span,
    /// What the unit is given.
    pub inputs: Vec<(String, String)>,
    /// What it computes, which is given from outside during a run (see [`FlatModel::driven`]).
    pub outputs: Vec<(String, String)>,
    /// Values of its parameters.
    pub parameters: Vec<(String, String)>,
    /// Those of the model's names of parameters whose values stand in their own declarations: nobody has set them.
    pub declared: BTreeSet<String>,
}

/// A model without components.
#[derive(Clone, Debug, Default)]
pub struct FlatModel {
    /// Full name of the class.
    pub name: Arc<str>,
    /// Description of the class.
    pub description: Option<Arc<str>>,
    /// Variables in the order of the text.
    pub variables: IndexVec<BlockId, VariableBlock>,
    /// Number of scalar variables.
    pub scalars: u32,
    /// Pool of numbers in slots.
    pub constants: IndexVec<ConstId, f64>,
    /// Those with units, ascending.
    pub quantities: Vec<Quantity>,
    /// Units of values that are not variables.
    pub claims: Vec<UnitClaim>,
    /// Declared units of the results of compiled functions: body, output, unit.
    pub result_units: Vec<(BodyId, u32, Arc<str>)>,
    /// Templates of the equations.
    pub templates: Templates,
    /// Equations in the order of the text, connection equations last.
    pub equations: Vec<EquationBlock>,
    /// Texts that equations of connections come from, ascending: `connect` or, where nothing is connected, the connector.
    pub connects: Vec<Span>,
    /// Delays in the order of their sites.
    pub delays: Vec<DelayBlock>,
    /// What is said of clocks.
    pub clocks: Vec<ClockOperator>,
    /// Equations (indices into `equations`) that stand in `when` of clocks: the first of these clocks and their number.  The equations
    /// of each clock are neighbours.
    pub clocked: Vec<(u32, VarId, u32)>,
    /// Inputs that follow recorded samples, in the order of their numbers.
    pub driven: Vec<DrivenBlock>,
    /// Blocks that are units of other tools.
    pub foreign: Vec<ForeignBlock>,
    /// Texts of assertions and terminations.
    pub messages: Vec<Message>,
    /// The `experiment` annotation.
    pub experiment: Experiment,
    /// Equations that terms can be injected into (indices into `equations`): those written as `left = right`.
    pub injectable: Vec<u32>,
    /// Values that are set for a run where declarations say otherwise; they stay data, but nothing is divided by one that is zero.
    pub given: Vec<(VarId, f64)>,
    /// Strings, looked at where the model leaves for other tools.
    pub texts: Vec<TextBlock>,
    /// Names of those whose values follow from what can be set or is found at the start.
    pub open_texts: Vec<String>,
    /// Names of those without a value, or with one that differs along an array of components.
    pub unknown_texts: Vec<String>,
    /// Public inputs of the model itself: parameters, if it has no physical connectors outside.
    pub inputs: Vec<BlockId>,
    /// Public outputs of the model itself.
    pub outputs: Vec<BlockId>,
    /// Components that bring too many or too few equations, where the model has too many or too few.
    pub imbalances: Vec<Imbalance>,
    /// Connectors and inputs of the model itself, where it lacks nothing but what they would bring.
    pub open_ends: Vec<Arc<str>>,
    /// Inputs of components that are neither connected nor given a value in their declaration; known where numbers differ.
    pub open_inputs: Vec<BlockId>,
    /// Potentials of physical connectors.
    pub potentials: Vec<Potential>,
    /// Their flows.
    pub flows: Vec<BlockId>,
    /// Connectors that can be seen from outside, in the order of the text.
    pub terminals: Vec<Terminal>,
    /// Where the text of the model can be added to; none where it has no declarations or no equations of its own.
    pub gaps: Option<Gaps>,
    /// Outputs of the model's components that nothing reads, by name; looked for where an input lacks its source.
    pub unread_outputs: Vec<String>,
    /// Components that a text of the user's declares and whose insides stand in libraries: name, and where it is declared.
    pub library_parts: Vec<(Arc<str>, Span)>,
}

impl FlatModel {
    /// Where users find a variable: its declaration, or that of the component which holds it where the former stands in a library.
    pub fn shown_span(&self, block: BlockId) -> Span {
        let own = &self.variables[block];
        let name = own.name.parts.first().map_or("", |(text, _)| text);
        let component = name.split('.').next().unwrap_or(name);
        let found = self.library_parts.iter().find(|(known, span)| {
            let is_inside = name.len() > component.len() || own.name.parts.len() > 1;
            &**known == component && is_inside && span.file != own.origin.span.file
        });
        found.map_or(own.origin.span, |(_, span)| *span)
    }

    /// True for equations of a connection.
    pub fn is_connection(&self, block: &EquationBlock) -> bool {
        self.connects.binary_search(&block.origin.span).is_ok()
    }

    /// The block of a scalar variable and its position in it.
    pub fn locate(&self, v: VarId) -> (BlockId, usize) {
        let block = self.variables.raw.partition_point(|b| b.first <= v) - 1;
        // Empty blocks share their `first` with the next one; the last of them owns the element.
        (BlockId::new(block), (v.0 - self.variables.raw[block].first.0) as usize)
    }

    /// The full name of a scalar variable.
    pub fn var_name(&self, v: VarId) -> String {
        let (block, k) = self.locate(v);
        self.variables[block].name.element(k)
    }

    /// The unit of a number, if it has one.
    pub fn quantity(&self, id: ConstId) -> Option<&Quantity> {
        self.quantities.binary_search_by_key(&id, |q| q.id).ok().map(|k| &self.quantities[k])
    }

    /// The delay block of a site and the position of the site in it.
    pub fn delay(&self, site: u32) -> Option<(&DelayBlock, u32)> {
        let block = self.delays.partition_point(|b| b.first <= site).checked_sub(1)?;
        let block = &self.delays[block];
        (site < block.first + block.count).then(|| (block, site - block.first))
    }

    /// Number of delay sites.
    pub fn delay_sites(&self) -> u32 {
        self.delays.last().map_or(0, |block| block.first + block.count)
    }

    /// Number of inputs that follow recorded samples.
    pub fn driven_inputs(&self) -> u32 {
        self.driven.last().map_or(0, |block| block.first + block.count)
    }

    /// The variable that is an input which follows recorded samples.
    pub fn driven_variable(&self, input: u32) -> Option<VarId> {
        let block = self.driven.iter().find(|block| (block.first..block.first + block.count).contains(&input))?;
        Some(VarId(block.variable.0 + input - block.first))
    }

    /// Full names of the inputs of the model itself that can follow recorded samples.
    pub fn real_inputs(&self) -> Vec<String> {
        let blocks = self.inputs.iter().map(|&block| &self.variables[block]);
        let real = blocks.filter(|block| block.kind == ValueKind::Real);
        real.flat_map(|block| (0..block.count as usize).map(|k| block.name.element(k))).collect()
    }

    fn driven_name(&self, input: u32) -> String {
        self.driven_variable(input).map_or_else(|| "?".into(), |v| self.var_name(v))
    }

    fn source_name(&self, site: u32) -> String {
        self.delay(site).map_or_else(|| "?".into(), |(block, k)| self.var_name(VarId(block.source.0 + k)))
    }

    /// What a slot reads, in the user's words, without its sign.
    pub fn target_name(&self, operand: Operand) -> String {
        match operand.target() {
            Target::Var(v) => self.var_name(v),
            Target::Der(v) => format!("der({})", self.var_name(v)),
            Target::Pre(v) => format!("pre({})", self.var_name(v)),
            Target::Start(v) => format!("{}.start", self.var_name(v)),
            Target::Const(c) => match self.quantity(c) {
                Some(quantity) => quantity.name.to_string(),
                None => hyd_symbolic::format_number(self.constants[c]),
            },
            Target::Held(r) => format!("relation {}", r + 1),
            Target::Chosen(k) => format!("chosen {}", k + 1),
            Target::Delayed(site) => format!("delayed({})", self.source_name(site)),
            Target::DelayedRate(site) => format!("delayed(der({}))", self.source_name(site)),
            Target::Input(k) => format!("recorded({})", self.driven_name(k)),
            Target::InputRate(k) => format!("recorded(der({}))", self.driven_name(k)),
        }
    }

    /// The same for messages about what is written: a long sum is `sum(...)`, whatever variables stand for it and its parts.
    pub(crate) fn written_name(&self, operand: Operand) -> String {
        let fold = |v: VarId| match self.variables[self.locate(v).0].made {
            Some(Made::Fold(name)) => Some(name),
            _ => None,
        };
        match operand.target() {
            Target::Var(v) => fold(v).map_or_else(|| self.var_name(v), |name| format!("{name}(...)")),
            _ => self.target_name(operand),
        }
    }

    /// What a slot reads, in the user's words.
    pub fn operand_name(&self, operand: Operand) -> String {
        let text = self.target_name(operand);
        if operand.negated() { format!("(-{text})") } else { text }
    }

    /// An expression over the operands as text.
    pub fn print(&self, root: hyd_symbolic::NodeId, operands: &[Operand]) -> String {
        self.print_named(&|operand| self.target_name(operand), root, operands)
    }

    /// The same with names of what slots read.
    pub(crate) fn print_named(
        &self,
        name: &dyn Fn(Operand) -> String,
        root: hyd_symbolic::NodeId,
        operands: &[Operand],
    ) -> String {
        let name = |slot: hyd_symbolic::SlotId| name(operands[slot.index()]);
        let negated = |slot: hyd_symbolic::SlotId| operands[slot.index()].negated();
        hyd_symbolic::print_signed(&self.templates.arena, root, &name, &negated, false)
    }

    /// The derivative of an expression with respect to a slot, as one with respect to what the slot names.
    pub fn print_partial(
        &self,
        root: hyd_symbolic::NodeId,
        operands: &[Operand],
        slot: hyd_symbolic::SlotId,
    ) -> String {
        let name = |slot: hyd_symbolic::SlotId| self.target_name(operands[slot.index()]);
        let negated = |slot: hyd_symbolic::SlotId| operands[slot.index()].negated();
        hyd_symbolic::print_signed(&self.templates.arena, root, &name, &negated, operands[slot.index()].negated())
    }

    /// Number of scalar equations of a section.
    pub fn count(&self, section: Section) -> usize {
        self.equations.iter().filter(|e| e.section == section).map(|e| e.count as usize).sum()
    }
}
