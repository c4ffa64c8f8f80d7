//! Random numbers of the generator with hidden state: `ModelicaRandom_setInternalState_xorshift1024star` sets it and
//! `ModelicaRandom_impureRandom_xorshift1024star` draws the next number.
//!
//! What happens at an event is computed as often as the event needs it, so the state must be a value like any other.  Each place that
//! draws has two discrete variables of its own, the state after it and the number:
//! `(state, number) = if reached then next(state before) else (state before, pre(number))`.  The places follow each other as the text is
//! read; the first begins with `pre` of the last one, at the start with the state that was set.  A place is a call, the way to it through
//! functions, and the turn of the loops around.

use hyd_instance::{InstId, LocalClass, ScalarType, Value};
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{Node, NodeId};
use hyd_syntax::tree::{Ident, Name};
use hyd_system::{ValueKind, Variability};
use hyd_typed::Function;

use crate::model::{Section, VarId};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, Outputs};
use crate::state::index::{Affine, Kind, SlotKey, Slots};
use crate::state::made::Made;
use crate::state::node::Typed;

/// Integers of the state: sixteen words of 64 bits, and which of them is next.
const STATE: usize = 33;

/// Something that happens at an event and may draw random numbers.
#[derive(Clone, Debug)]
pub(crate) struct AtEvent {
    /// It happens.
    pub acts: NodeId,
    /// The loops around it; counters beyond them run through elements.
    pub loops: usize,
    /// The calls that lead here, each with the loop variables around it.
    pub way: Vec<(Span, Vec<Affine>)>,
}

/// A place that draws: the instance, the calls with the loops around them, and how often the statements have been here before.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct Place {
    inst: InstId,
    turn: Vec<i64>,
    way: Vec<(Span, Vec<i64>)>,
    before: u32,
}

/// The first place that draws: the state before it.
#[derive(Clone)]
pub(crate) struct FirstDraw {
    state: VarId,
    origin: Origin,
}

/// A state that was set, over the slots of the equation that it was set in.
pub(crate) struct Seeding {
    state: Vec<NodeId>,
    slots: Vec<SlotKey>,
}

impl AtEvent {
    pub(crate) fn new(acts: NodeId, cx: &Context) -> Self {
        Self { acts, loops: cx.counts.len(), way: Vec::new() }
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
        if self.in_body(cx) {
            let message = "the state of this generator is set in a function that is compiled";
            return Err(self.error(Code::OutsideProfile, cx.called_from.unwrap_or(span), message));
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
        let place = self.place_of_draw(&event.through(span, cx), cx)?;
        let arena = &mut self.model.templates.arena;
        let reached = cx.holds.map_or(event.acts, |holds| arena.and(event.acts, holds));
        self.drawn += 1;
        let known = self.all_notes().find_map(|notes| notes.draws.get(&place).copied());
        let number = match known {
            Some(known) => known,
            None => {
                let number = self.make_draw(span, reached, cx)?;
                self.tables().notes.draws.insert(place, number);
                number
            }
        };
        Ok(vec![(output, Local::Node(Typed::real(self.state_slot(Kind::Var, number, 0))))])
    }

    fn place_of_draw(&mut self, event: &AtEvent, cx: &Context) -> Result<Place, Fail> {
        let fixed = cx.fixed.as_deref().unwrap_or_default();
        let turn = fixed.get(..event.loops).ok_or(Fail::NeedsExpansion)?.to_vec();
        let known = |values: &[Affine]| values.iter().map(Affine::as_constant).collect::<Option<Vec<i64>>>();
        let way = event.way.iter().map(|(span, values)| Some((*span, known(values)?)));
        let way = way.collect::<Option<Vec<_>>>().ok_or(Fail::NeedsExpansion)?;
        let mut place = Place { inst: cx.scope.inst, turn, way, before: 0 };
        let met = self.draws_met.entry(place.clone()).or_default();
        place.before = *met;
        *met += 1;
        Ok(place)
    }

    fn state_slot(&mut self, kind: Kind, first: VarId, k: usize) -> NodeId {
        let slot = self.slots.slot(SlotKey::Variable(kind, first, Affine::constant(k as i64)));
        self.model.templates.arena.slot(slot)
    }

    /// The variables of a place and their equations: the number.
    fn make_draw(&mut self, span: Span, reached: NodeId, cx: &Context) -> Result<VarId, Fail> {
        let origin = Origin { path: self.path(cx.scope.inst), span: cx.called_from.unwrap_or(span) };
        let count = self.all_notes().map(|notes| notes.draws.len()).sum::<usize>() + 1;
        let integer = (ValueKind::Integer, Variability::Discrete);
        let newest = self.all_notes().find_map(|notes| notes.newest_draw);
        let before = match newest {
            Some(newest) => newest,
            None => {
                let state = self.make(Made::Event, "$draw0.state".into(), &[STATE], integer.clone(), origin.clone());
                self.tables().notes.first_draw = Some(FirstDraw { state, origin: origin.clone() });
                state
            }
        };
        let given =
            (0..STATE).map(|k| Typed { node: self.state_slot(Kind::Var, before, k), scalar: ScalarType::Integer });
        let given = Local::array(given.collect(), vec![STATE]);
        let (next, number) = self.next_state(span, given, cx)?;
        let state = self.make(Made::Event, format!("$draw{count}.state"), &[STATE], integer, origin.clone());
        let real = (ValueKind::Real, Variability::Discrete);
        let drawn = self.make(Made::Event, format!("$draw{count}.number"), &[], real, origin.clone());
        for (k, node) in next.into_iter().enumerate() {
            let (now, kept) = (self.state_slot(Kind::Var, state, k), self.state_slot(Kind::Var, before, k));
            let value = self.model.templates.arena.select(reached, node, kept);
            self.emit(Section::Discrete, now, value, &[], &origin);
        }
        let (now, kept) = (self.state_slot(Kind::Var, drawn, 0), self.state_slot(Kind::Pre, drawn, 0));
        let value = self.model.templates.arena.select(reached, number, kept);
        self.emit(Section::Discrete, now, value, &[], &origin);
        self.tables().notes.newest_draw = Some(state);
        Ok(drawn)
    }

    /// The state after one that is given, and the number.
    fn next_state(&mut self, span: Span, state: Local, cx: &Context) -> Result<(Vec<NodeId>, NodeId), Fail> {
        let name = |name: &str| Ident { name: Name::from(name), span };
        let class = self.scopes.table.absolute(&["Hyd", "Random", "xorshift1024star"].map(name));
        let Some(class) = class else {
            return Err(self.error(
                Code::UnknownName,
                span,
                "the library `Hyd`, which has the generator, is not there",
            ));
        };
        let function = self.function(&LocalClass::plain(class), cx.scope)?;
        let mut around =
            Context { depth: cx.depth, in_when: true, called_from: cx.called_from, ..Context::new(cx.scope) };
        let outputs = self.call_with(span, &function, vec![state], &mut around)?;
        let mut nodes: Vec<NodeId> = Vec::with_capacity(STATE + 1);
        for (_, output) in &outputs {
            nodes.extend(self.values_of(span, output.clone())?.iter().map(|value| value.node));
        }
        match (nodes.len(), nodes.first().copied()) {
            // The number is the first of the outputs.
            (n, Some(number)) if n == STATE + 1 => Ok((nodes.split_off(1), number)),
            _ => Err(self.error(Code::BadArguments, span, format!("`{}` is not this generator", function.name()))),
        }
    }

    /// When all places are known: what the first begins with.
    pub(crate) fn settle_draws(&mut self) {
        let (Some(first), Some(newest)) = (self.notes.first_draw.take(), self.notes.newest_draw) else { return };
        let at_translation = match self.scopes.found.hidden_state.take() {
            Some(state) if self.notes.seedings.is_empty() => {
                let numbers: Vec<f64> = state.flatten().into_iter().filter_map(Value::as_real).collect();
                let arena = &mut self.model.templates.arena;
                let state: Vec<NodeId> = numbers.into_iter().map(|number| arena.constant(number)).collect();
                (state.len() == STATE).then_some(Seeding { state, slots: Vec::new() })
            }
            _ => None,
        };
        let Some(seeding) = self.notes.seedings.pop().or(at_translation) else {
            let message = "random numbers are drawn here from a generator that nothing sets up";
            let fault = Diagnostic::error(Code::OutsideProfile, message).at(first.origin.span, "");
            self.report(fault.help("`initializeImpureRandom(seed)` in the declaration of a parameter sets it up"));
            return;
        };
        self.slots = Slots::of(seeding.slots);
        for (k, start) in seeding.state.into_iter().enumerate() {
            let (now, before) = (self.state_slot(Kind::Var, first.state, k), self.state_slot(Kind::Pre, newest, k));
            let arena = &mut self.model.templates.arena;
            let initial = arena.intern(Node::Initial);
            let value = arena.select(initial, start, before);
            self.emit(Section::Discrete, now, value, &[], &first.origin);
        }
    }
}
