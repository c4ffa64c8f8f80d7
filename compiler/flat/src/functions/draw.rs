//! Random numbers of the generator with hidden state: `ModelicaRandom_setInternalState_xorshift1024star` sets it and
//! `ModelicaRandom_impureRandom_xorshift1024star` draws the next number.
//!
//! What happens at an event is computed as often as the event needs it, so the state must be a value like any other.  Each place that
//! draws has two discrete variables of its own, the state after it and the number (`hidden_state` has their equations).  A place is a call,
//! the way to it through functions, and the turn of the loops around.

use hyd_instance::InstId;
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::Name;
use hyd_system::{ValueKind, Variability};
use hyd_typed::Function;

use crate::model::VarId;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, Outputs};
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::made::Made;
use crate::state::node::Typed;

/// Integers of the state: sixteen words of 64 bits, and which of them is next.
pub(crate) const STATE: usize = 33;

/// Something that happens at an event and may draw random numbers.
#[derive(Clone, Debug)]
pub(crate) struct AtEvent {
    /// The component of the model in whose text it stands; functions are the same for all components.
    pub inst: InstId,
    /// It happens.
    pub acts: NodeId,
    /// The loops around it; counters beyond them run through elements.
    pub loops: usize,
    /// The calls that lead here, each with the loop variables around it.
    pub way: Vec<(Span, Vec<Affine>)>,
}

/// A place that draws: the component, the calls with the loops around them, and how often the statements have been here before.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct Place {
    inst: InstId,
    turn: Vec<i64>,
    way: Vec<(Span, Vec<i64>)>,
    before: u32,
}

/// What a place draws: where it is reached, over the slots of the equation that it stands in, and its variables.
pub(crate) struct Drawn {
    pub reached: NodeId,
    pub slots: Vec<SlotKey>,
    pub state: VarId,
    pub number: VarId,
    pub origin: Origin,
}

/// A state that was set, over the slots of the equation that it was set in.
pub(crate) struct Seeding {
    pub state: Vec<NodeId>,
    pub slots: Vec<SlotKey>,
}

impl AtEvent {
    pub(crate) fn new(acts: NodeId, cx: &Context) -> Self {
        Self { inst: cx.scope.inst, acts, loops: cx.counts.len(), way: Vec::new() }
    }

    /// The same in a function that is called from `cx`.
    pub(crate) fn through(&self, span: Span, cx: &Context) -> Self {
        let mut inner = self.clone();
        let counted = cx.names.iter().filter_map(|(_, local)| match local {
            Local::Index(value) => Some(value.clone()),
            _ => None,
        });
        inner.way.push((span, counted.collect()));
        inner
    }
}

impl Flattener<'_, '_> {
    /// The state is set to the values of an argument.
    pub(super) fn set_hidden_state(&mut self, span: Span, values: Option<&Local>, cx: &Context) -> Result<(), Fail> {
        // Of a compiled function nobody outside knows the values: whoever draws hears that nothing sets the generator up.
        if self.in_body(cx) {
            return Ok(());
        }
        let state: Option<Vec<NodeId>> = match values {
            Some(Local::Array(items, _)) if items.len() == STATE => Some(items.iter().map(|item| item.node).collect()),
            _ => None,
        };
        let Some(state) = state else {
            return Err(self.error(
                Code::BadArguments,
                span,
                format!("the state of this generator has {STATE} integers"),
            ));
        };
        let slots = self.slots.keys.clone();
        self.tables().notes.seedings.push(Seeding { state, slots });
        Ok(())
    }

    /// The next random number, drawn by a call in `cx`.
    pub(super) fn draw(&mut self, span: Span, callee: &Function, cx: &Context) -> Result<Outputs, Fail> {
        let output = callee.outputs().next().map_or_else(|| Name::from(""), |output| output.name.name.clone());
        let Some(event) = cx.event.as_ref().filter(|_| !self.in_body(cx)) else {
            let message = format!(
                "`{}` draws from a generator with a hidden state, which is drawn from at events only",
                callee.name()
            );
            let at = cx.called_from.unwrap_or(span);
            let help = "draw in a `when`, outside of loops that the run decides; a generator with a state of its own, such as \
                        `Xorshift1024star.random`, may be used anywhere";
            self.report(Diagnostic::error(Code::OutsideProfile, message).at(at, "").help(help));
            return Err(Fail::Reported);
        };
        let (place, inst) = (self.place_of_draw(&event.through(span, cx), cx)?, event.inst);
        let arena = &mut self.model.templates.arena;
        let reached = cx.holds.map_or(event.acts, |holds| arena.and(event.acts, holds));
        self.drawn += 1;
        let known = self.all_notes().find_map(|notes| notes.draws.get(&place).copied());
        let number = match known {
            Some(known) => known,
            None => {
                let number = self.make_draw(inst, cx.called_from.unwrap_or(span), reached);
                self.tables().notes.draws.insert(place, number);
                number
            }
        };
        let slot = self.slots.slot(SlotKey::Variable(Kind::Var, number, Affine::constant(0)));
        Ok(vec![(output, Local::Node(Typed::real(self.model.templates.arena.slot(slot))))])
    }

    fn place_of_draw(&mut self, event: &AtEvent, cx: &Context) -> Result<Place, Fail> {
        let fixed = cx.fixed.as_deref().unwrap_or_default();
        let turn = fixed.get(..event.loops).ok_or(Fail::NeedsExpansion)?.to_vec();
        let known = |values: &[Affine]| values.iter().map(Affine::as_constant).collect::<Option<Vec<i64>>>();
        let way = event.way.iter().map(|(span, values)| Some((*span, known(values)?)));
        let way = way.collect::<Option<Vec<_>>>().ok_or(Fail::NeedsExpansion)?;
        let mut place = Place { inst: event.inst, turn, way, before: 0 };
        let met = self.draws_met.entry(place.clone()).or_default();
        place.before = *met;
        *met += 1;
        Ok(place)
    }

    /// The variables of a place: the number.
    fn make_draw(&mut self, inst: InstId, span: Span, reached: NodeId) -> VarId {
        let origin = Origin { path: self.path(inst), span };
        let count = self.all_notes().map(|notes| notes.draws.len()).sum::<usize>() + 1;
        let integer = (ValueKind::Integer, Variability::Discrete);
        let state = self.make(Made::Event, format!("$draw{count}.state"), &[STATE], integer, origin.clone());
        let real = (ValueKind::Real, Variability::Discrete);
        let number = self.make(Made::Event, format!("$draw{count}.number"), &[], real, origin.clone());
        let slots = self.slots.keys.clone();
        self.tables().notes.drawn.push(Drawn { reached, slots, state, number, origin });
        number
    }
}
