//! Calls that give arrays, remembered while one equation is lowered.
//!
//! An equation over arrays is lowered element by element, and its sizes before that, each asking for the call in it.  The text of a
//! call means the same as long as the names, loops and subscripts around it do, and its nodes stay what they are as long as
//! the slots do; so it is made once.  Without this a function that fills an array of n elements in a loop takes n² statements.

use std::rc::Rc;

use hyd_instance::{InstId, Scope};
use hyd_source::Span;
use hyd_syntax::tree::Name;
use hyd_typed::{Expr, Kind};

use crate::model::UnitClaim;
use crate::state::context::{Context, Local};
use crate::state::flattener::{Flattener, Outputs};
use crate::state::index::{Affine, Slots};

/// Calls remembered at each depth of calls.
const KEPT: usize = 16;

/// Calls made since the slots were begun, which go where the slots go.
#[derive(Default)]
pub(crate) struct CallMemory {
    known: Vec<Known>,
}

struct Known {
    place: Place,
    outputs: Outputs,
    /// What the call claims of units, and where that was noted.
    claims: Vec<UnitClaim>,
    noted: usize,
}

/// All that says what a call means.
struct Place {
    span: Span,
    /// Places of its arguments: an operator and the conversion of an operand to its record stand at one place.
    arguments: Vec<Span>,
    scope: Scope,
    depth: usize,
    no_event: bool,
    in_when: bool,
    may_add_variables: bool,
    called_from: Option<Span>,
    called: Vec<(InstId, bool)>,
    counts: Vec<usize>,
    /// Those subscripts around it that were asked for.
    implicit: Vec<(InstId, Vec<Affine>)>,
    ends: Vec<usize>,
    /// The names in its arguments and what they stood for, if they were local.
    names: Vec<(Name, Option<Local>)>,
}

impl Place {
    fn new(call: &Expr, used: &[InstId], cx: &Context) -> Self {
        let mut names: Vec<Name> = Vec::new();
        hyd_typed::any_local(call, &mut |local| {
            if !names.contains(local.name()) {
                names.push(local.name().clone());
            }
            false
        });
        Self {
            span: call.span,
            arguments: arguments(call).map(|argument| argument.span).collect(),
            scope: cx.scope,
            depth: cx.depth,
            no_event: cx.no_event,
            in_when: cx.in_when,
            may_add_variables: cx.may_add_variables,
            called_from: cx.called_from,
            called: cx.called.clone(),
            counts: cx.loop_counts(),
            implicit: cx.implicit.iter().filter(|(id, _)| used.contains(id)).cloned().collect(),
            ends: cx.ends.clone(),
            names: names.into_iter().map(|n| (n.clone(), cx.local(&n).cloned())).collect(),
        }
    }

    fn is(&self, call: &Expr, cx: &Context) -> bool {
        (self.span, self.scope, self.depth) == (call.span, cx.scope, cx.depth)
            && arguments(call).map(|argument| argument.span).eq(self.arguments.iter().copied())
            && (self.no_event, self.in_when, self.called_from) == (cx.no_event, cx.in_when, cx.called_from)
            && self.may_add_variables == cx.may_add_variables
            && self.called == cx.called
            && self.implicit.iter().all(|around| cx.implicit.contains(around))
            && self.ends == cx.ends
            && self.counts == cx.loop_counts()
            && self.names.iter().all(|(name, local)| match (local, cx.local(name)) {
                (Some(before), Some(now)) => same(before, now),
                (before, now) => before.is_none() && now.is_none(),
            })
    }
}

/// The arguments of a call.
fn arguments(call: &Expr) -> impl Iterator<Item = &Expr> {
    let (positional, named) = match &call.kind {
        Kind::Call(own) => (&own.positional[..], &own.named[..]),
        Kind::Record(own) => (&own.given[..], &[][..]),
        _ => (&[][..], &[][..]),
    };
    positional.iter().chain(named.iter().map(|(_, value)| value))
}

impl CallMemory {
    pub(crate) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }
}

impl Flattener<'_, '_> {
    /// Begins an equation: its slots and what is known of its calls.
    pub(crate) fn begin_slots(&mut self) {
        self.slots = Slots::default();
        self.asked.clear();
        self.statements = 0;
    }

    /// Subscripts around the text are asked for.
    pub(crate) fn note_subscripts_of(&mut self, array: InstId) {
        if !self.asked.contains(&array) {
            self.asked.push(array);
        }
    }

    /// Calls in compiled functions and in algorithm sections of models depend on what was assigned before.
    fn may_be_known(&self, cx: &Context) -> bool {
        self.builders.is_empty() && cx.assigned.is_none()
    }

    /// The outputs of a call that was made before.
    pub(crate) fn known_call(&mut self, call: &Expr, cx: &Context) -> Option<Outputs> {
        if self.slots.calls.is_empty() || !self.may_be_known(cx) {
            return None;
        }
        let position = self.slots.calls.known.iter().rposition(|known| known.place.is(call, cx))?;
        for k in 0..self.slots.calls.known[position].place.implicit.len() {
            self.note_subscripts_of(self.slots.calls.known[position].place.implicit[k].0);
        }
        let known = &self.slots.calls.known[position];
        let end = known.noted + known.claims.len();
        let noted = known.claims.first() == self.claim_at(known.noted)
            && known.claims.last() == self.claim_at(end.wrapping_sub(1));
        if !known.claims.is_empty() && !noted {
            let (claims, place) = (known.claims.clone(), self.claims());
            self.slots.calls.known[position].noted = place;
            self.tables().claims.extend(claims);
        }
        Some(self.slots.calls.known[position].outputs.clone())
    }

    /// Remembers a call that gave arrays and made nothing else but claims, which are kept next.
    pub(crate) fn remember_call(&mut self, call: &Expr, claims: &[UnitClaim], outputs: &Outputs, cx: &Context) {
        let whole =
            |local: &Local| !matches!(local, Local::Node(_) | Local::Index(_) | Local::Value(_) | Local::Function(_));
        if !self.may_be_known(cx) || !outputs.iter().any(|(_, local)| whole(local)) {
            return;
        }
        let noted = self.claims();
        let all = &mut self.slots.calls.known;
        all.retain(|known| known.place.depth <= cx.depth);
        let mut here = all.iter().enumerate().filter(|(_, known)| known.place.depth == cx.depth);
        if let (Some((oldest, _)), true) = (here.next(), here.count() + 1 >= KEPT) {
            all.remove(oldest);
        }
        all.push(Known {
            place: Place::new(call, &self.asked, cx),
            outputs: outputs.clone(),
            claims: claims.to_vec(),
            noted,
        });
    }
}

fn same_names(a: &[(Name, Local)], b: &[(Name, Local)]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|((n, x), (m, y))| n == m && same(x, y))
}

/// Values that are certainly the same; arrays if they are shared.
fn same(a: &Local, b: &Local) -> bool {
    match (a, b) {
        (Local::Index(x), Local::Index(y)) => x == y,
        (Local::Value(x), Local::Value(y)) => x == y,
        (Local::Node(x), Local::Node(y)) => x.node == y.node && x.scalar == y.scalar,
        (Local::Array(x, shape), Local::Array(y, other)) => Rc::ptr_eq(x, y) && shape == other,
        (Local::Record(x), Local::Record(y)) => same_names(x, y),
        (Local::Records(x, shape), Local::Records(y, other)) => shape == other && same_names(x, y),
        (Local::Function(x), Local::Function(y)) => {
            x.function.inst == y.function.inst && same_names(&x.given, &y.given)
        }
        _ => false,
    }
}
