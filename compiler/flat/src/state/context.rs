//! Where an expression is lowered: its scope, the loops around it, and what its names mean.

use std::rc::Rc;

use hyd_instance::{InstId, ScalarType, Scope, Value};
use hyd_source::{Reported, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::Name;
use hyd_typed::{Base, Expr, Function, RecordType, Type};
use rustc_hash::FxHashSet;

use crate::functions::draw::AtEvent;
use crate::model::VarId;
use crate::sections::when_condition::StatementCondition;
use crate::state::index::{Affine, CounterId, Cut, Window};
use crate::state::node::Typed;

/// Why an expression could not be lowered.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Fail {
    /// A message has been given.
    Reported,
    /// A subscript is not affine in the counters: lower again with fixed counters.
    NeedsExpansion,
    /// It is affine, or a condition decided, on parts of the values of a counter: lower again for each part.
    Split(CounterId, Cut),
    /// A function cannot be run symbolically: it must be compiled.
    Opaque,
}

impl From<Reported> for Fail {
    fn from(_: Reported) -> Self {
        Fail::Reported
    }
}

/// What a local name stands for.
#[derive(Clone, Debug)]
pub(crate) enum Local {
    /// A loop variable with values affine in the counters.
    Index(Affine),
    /// A loop variable with a fixed value of another type.
    Value(Value),
    /// A variable of a function that is being inlined.
    Node(Typed),
    /// An array: its elements, last subscript fastest, shared by all that hold it, and its sizes.
    Array(Rc<Vec<Typed>>, Vec<usize>),
    /// A record: its fields in order.
    Record(Vec<(Name, Local)>),
    /// An array of records: its fields, each an array with these sizes and then its own.
    Records(Vec<(Name, Local)>, Vec<usize>),
    /// A function with some of its inputs given.
    Function(Rc<Closure>),
}

/// A function that was handed on, and the inputs that were given on the way.
#[derive(Debug)]
pub(crate) struct Closure {
    pub function: Rc<Function>,
    pub given: Vec<(Name, Local)>,
}

impl Local {
    /// Its type, as far as its value says.
    pub(crate) fn ty(&self) -> Type {
        let scalar = |typed: &Typed| Base::Scalar(typed.scalar.clone());
        let record = |fields: &[(Name, Local)], outer: usize| {
            let field = |(name, field): &(Name, Local)| {
                let ty = field.ty();
                (name.clone(), ty.with_rank(ty.rank.saturating_sub(outer)))
            };
            let fields = fields.iter().map(field).collect();
            Type {
                base: Base::Record(Rc::new(RecordType { name: String::new(), class: None, inst: None, fields })),
                rank: outer,
            }
        };
        match self {
            Local::Index(_) => Type::scalar(ScalarType::Integer),
            Local::Value(value) => value_type(value),
            Local::Node(typed) => Type { base: scalar(typed), rank: 0 },
            Local::Array(items, shape) => {
                Type { base: items.first().map_or(Base::Scalar(ScalarType::Real), scalar), rank: shape.len() }
            }
            Local::Record(fields) => record(fields, 0),
            Local::Records(fields, shape) => record(fields, shape.len()),
            // What it gives is asked of its declaration.
            Local::Function(_) => Type { base: Base::Function(Rc::new(Type::scalar(ScalarType::Real))), rank: 0 },
        }
    }

    /// An array with its sizes.
    pub(crate) fn array(items: Vec<Typed>, shape: Vec<usize>) -> Self {
        Local::Array(Rc::new(items), shape)
    }
}

/// The surroundings of an expression.
#[derive(Clone, Debug)]
pub(crate) struct Context {
    /// Where names are looked up.
    pub scope: Scope,
    /// Number of values of each counter.
    pub counts: Vec<usize>,
    /// Fixed values of the counters, when the loops are run through.
    pub fixed: Option<Vec<i64>>,
    /// Parts of the values that counters run through; the others run through all.
    pub windows: Vec<Window>,
    /// How often counters may be cut into parts.
    pub cuts_left: u32,
    /// Subscripts (from 0) of the arrays of components around the scope.
    pub implicit: Vec<(InstId, Vec<Affine>)>,
    /// Local names, innermost last.
    pub names: Vec<(Name, Local)>,
    /// Relations here cause no events.
    pub no_event: bool,
    /// Sizes that `end` means, innermost last.
    pub ends: Vec<usize>,
    /// In a `when` (where `pre` and `reinit` belong).
    pub in_when: bool,
    /// In an algorithm section of a model: variables assigned so far and their values.
    pub assigned: Option<Vec<(VarId, Typed)>>,
    /// In an algorithm section of a model: all variables it assigns somewhere.
    pub algorithm_targets: Rc<FxHashSet<VarId>>,
    /// In a branch, or in an algorithm section of a model: this place is reached; `None` where it always is.
    pub holds: Option<NodeId>,
    /// Conditions of the `when` statements of the section.
    pub whens: Vec<StatementCondition>,
    /// Their values where they stand among the statements; filled as the section is run.
    pub decided: Vec<(NodeId, NodeId, Span)>,
    /// In a function: its inputs.
    pub inputs: Vec<Name>,
    /// Nesting of function calls.
    pub depth: usize,
    /// In a function: the call in the equation that leads here.
    pub called_from: Option<Span>,
    /// The functions being run, outermost first; true for those in which this place is reached only under a condition that
    /// is known in the run.
    pub called: Vec<(InstId, bool)>,
    /// In what happens at an event, and may draw random numbers.
    pub event: Option<AtEvent>,
    /// The value is always wanted: a long sum in it may become variables and equations of its own.
    pub may_add_variables: bool,
}

impl Context {
    /// True if a loop variable without a fixed value occurs.
    pub(crate) fn has_counter_in(&self, expr: &Expr) -> bool {
        hyd_typed::any_local(
            expr,
            &mut |name| matches!(self.local(name.name()), Some(Local::Index(a)) if a.as_constant().is_none()),
        )
    }

    /// Surroundings without loops.
    pub(crate) fn new(scope: Scope) -> Self {
        Self {
            scope,
            counts: Vec::new(),
            fixed: None,
            windows: Vec::new(),
            cuts_left: 0,
            implicit: Vec::new(),
            names: Vec::new(),
            no_event: false,
            ends: Vec::new(),
            in_when: false,
            assigned: None,
            algorithm_targets: Rc::default(),
            holds: None,
            whens: Vec::new(),
            decided: Vec::new(),
            inputs: Vec::new(),
            depth: 0,
            called_from: None,
            called: Vec::new(),
            event: None,
            may_add_variables: false,
        }
    }

    /// Adds a counter with `count` values and returns it as a subscript from 0.
    pub(crate) fn counter(&mut self, count: usize) -> Affine {
        let id = CounterId(self.counts.len() as u32);
        let fixed = self.fixed.as_ref().and_then(|values| values.get(id.0 as usize));
        match (fixed, self.windows.iter().find(|window| window.counter == id)) {
            (Some(&value), _) => {
                self.counts.push(count);
                Affine::constant(value)
            }
            (None, Some(window)) => {
                self.counts.push(window.count);
                window.values()
            }
            (None, None) => {
                self.counts.push(count);
                Affine::counter(id)
            }
        }
    }

    /// The values that a counter runs through here.
    pub(crate) fn window(&self, counter: CounterId) -> Window {
        let known = self.windows.iter().find(|window| window.counter == counter).copied();
        known.unwrap_or(Window { counter, first: 0, stride: 1, count: self.counts[counter.0 as usize] })
    }

    /// The failure that has a counter cut into parts, where that is possible.
    pub(crate) fn cut(&self, counter: CounterId, cut: Cut) -> Fail {
        let fixed = self.fixed.as_ref().map_or(0, Vec::len);
        let whole = self.counts.get(counter.0 as usize).copied().unwrap_or(0);
        if self.cuts_left > 0 && counter.0 as usize >= fixed && cut.divides(whole) {
            Fail::Split(counter, cut)
        } else {
            Fail::NeedsExpansion
        }
    }

    /// Counts of the counters for [`emit`](crate::state::flattener::Flattener): fixed ones stand for one value.
    pub(crate) fn loop_counts(&self) -> Vec<usize> {
        let fixed = self.fixed.as_ref().map_or(0, Vec::len);
        self.counts.iter().enumerate().map(|(k, &count)| if k < fixed { 1 } else { count }).collect()
    }

    /// What follows happens only under a condition that is known in the run.
    pub(crate) fn depends_on_run(&mut self) {
        self.called.iter_mut().for_each(|(_, uncertain)| *uncertain = true);
    }

    /// True in an algorithm section of a model, outside functions.
    pub(crate) fn in_section(&self) -> bool {
        self.depth == 0 && self.assigned.is_some()
    }

    /// A local name.
    pub(crate) fn local(&self, name: &str) -> Option<&Local> {
        self.names.iter().rev().find(|(n, _)| n.as_ref() == name).map(|(_, v)| v)
    }

    /// The loop variables with fixed values, for evaluation at translation; `Err` if some are symbolic.
    pub(crate) fn env(&self) -> (hyd_instance::Env, bool) {
        let mut env = hyd_instance::Env { ends: self.ends.clone(), ..hyd_instance::Env::default() };
        let mut complete = true;
        for (name, local) in &self.names {
            match local {
                Local::Index(affine) => match affine.as_constant() {
                    Some(k) => env.names.push((name.clone(), Value::Integer(k))),
                    None => complete = false,
                },
                Local::Value(value) => env.names.push((name.clone(), value.clone())),
                Local::Node(_) | Local::Array(..) | Local::Record(_) | Local::Records(..) | Local::Function(_) => {}
            }
        }
        (env, complete)
    }
}

/// The type of a value known at translation.
fn value_type(value: &Value) -> Type {
    match value {
        Value::Real(_) => Type::scalar(ScalarType::Real),
        Value::Integer(_) => Type::scalar(ScalarType::Integer),
        Value::Boolean(_) => Type::scalar(ScalarType::Boolean),
        Value::Text(_) => Type::scalar(ScalarType::Text),
        Value::Object(_) => Type::scalar(ScalarType::Object),
        Value::Enumeration(e, _) => Type::scalar(ScalarType::Enumeration(e.clone())),
        Value::Array(items) => {
            let first = items.first().map_or(Type::scalar(ScalarType::Real), value_type);
            first.with_rank(first.rank + 1)
        }
        Value::Record(fields) => {
            let fields = fields.list.iter().map(|(name, value)| (name.clone(), value_type(value))).collect();
            Type {
                base: Base::Record(Rc::new(RecordType { name: String::new(), class: None, inst: None, fields })),
                rank: 0,
            }
        }
    }
}
