//! The equations of a generator of random numbers with hidden state, when all places that draw from it are known.
//!
//! `(state, number) = if reached then next(state before) else (state before, pre(number))` for each place.  They follow each other as the
//! text is read; the first begins with `pre` of the last one, at the start with the state that was set.

use hyd_instance::{LocalClass, ScalarType, Scope, Value};
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{Node, NodeId};
use hyd_syntax::tree::{Ident, Name};
use hyd_system::{ValueKind, Variability};

use crate::functions::draw::{Drawn, STATE, Seeding};
use crate::model::{Section, VarId};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey, Slots};
use crate::state::made::Made;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    /// The states and numbers of all places.
    pub(crate) fn settle_draws(&mut self) {
        let drawn = std::mem::take(&mut self.notes.drawn);
        let (Some(first), Some(last)) = (drawn.first(), drawn.last()) else { return };
        let origin = first.origin.clone();
        let Some(seeding) = self.notes.seedings.pop().or_else(|| self.state_of_translation()) else {
            let message = "random numbers are drawn here from a generator that nothing sets up";
            let fault = Diagnostic::error(Code::OutsideProfile, message).at(origin.span, "");
            self.report(fault.help("`initializeImpureRandom(seed)` in the declaration of a parameter sets it up"));
            return;
        };
        let integer = (ValueKind::Integer, Variability::Discrete);
        let begin = self.make(Made::Event, "$draw0.state".into(), &[STATE], integer, origin.clone());
        self.slots = Slots::of(seeding.slots);
        for (k, start) in seeding.state.into_iter().enumerate() {
            let (now, before) = (self.state_slot(Kind::Var, begin, k), self.state_slot(Kind::Pre, last.state, k));
            let arena = &mut self.model.templates.arena;
            let initial = arena.intern(Node::Initial);
            let value = arena.select(initial, start, before);
            self.emit(Section::Discrete, now, value, &[], &origin);
        }
        let mut before = begin;
        for place in drawn {
            let after = place.state;
            if self.settle_draw(place, before).is_err() {
                return;
            }
            before = after;
        }
    }

    fn settle_draw(&mut self, place: Drawn, before: VarId) -> Result<(), Fail> {
        let Drawn { reached, slots, state, number, origin } = place;
        self.slots = Slots::of(slots);
        let given =
            (0..STATE).map(|k| Typed { node: self.state_slot(Kind::Var, before, k), scalar: ScalarType::Integer });
        let given = Local::array(given.collect(), vec![STATE]);
        let (next, drawn) = self.next_state(origin.span, given)?;
        for (k, node) in next.into_iter().enumerate() {
            let (now, kept) = (self.state_slot(Kind::Var, state, k), self.state_slot(Kind::Var, before, k));
            let value = self.model.templates.arena.select(reached, node, kept);
            self.emit(Section::Discrete, now, value, &[], &origin);
        }
        let (now, kept) = (self.state_slot(Kind::Var, number, 0), self.state_slot(Kind::Pre, number, 0));
        let value = self.model.templates.arena.select(reached, drawn, kept);
        self.emit(Section::Discrete, now, value, &[], &origin);
        Ok(())
    }

    fn state_slot(&mut self, kind: Kind, first: VarId, k: usize) -> NodeId {
        let slot = self.slots.slot(SlotKey::Variable(kind, first, Affine::constant(k as i64)));
        self.model.templates.arena.slot(slot)
    }

    /// The state that a function run at translation has set.
    fn state_of_translation(&mut self) -> Option<Seeding> {
        let state = self.scopes.found.hidden_state.take()?;
        let numbers: Vec<f64> = state.flatten().into_iter().filter_map(Value::as_real).collect();
        let state: Vec<NodeId> = numbers.into_iter().map(|k| self.model.templates.arena.constant(k)).collect();
        (state.len() == STATE).then_some(Seeding { state, slots: Vec::new() })
    }

    /// The state after one that is given, and the number.
    fn next_state(&mut self, span: Span, state: Local) -> Result<(Vec<NodeId>, NodeId), Fail> {
        let name = |name: &str| Ident { name: Name::from(name), span };
        let class = self.scopes.table.absolute(&["Hyd", "Random", "xorshift1024star"].map(name));
        let Some(class) = class else {
            return Err(self.error(
                Code::UnknownName,
                span,
                "the library `Hyd`, which has the generator, is not there",
            ));
        };
        let scope = Scope { inst: self.tree.root, frame: 0 };
        let function = self.function(&LocalClass::plain(class), scope)?;
        let mut around = Context { in_when: true, ..Context::new(scope) };
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
}
