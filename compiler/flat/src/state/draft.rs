//! What lowering makes: kept as a whole, or dropped as a whole.
//!
//! Whether an equation can be lowered once for all values of its counters, whether a call can be run symbolically, whether a sum can be
//! taken apart is found out by trying.  An attempt writes into a [`Draft`] of its own, on top of the model and of the drafts of attempts
//! around it, and sees all of them.  When it has ended the draft belongs to whoever asked for it, who keeps it
//! ([`Flattener::keep`]) or lets it go: what was made, noted and said goes with it.  Templates and numbers are pools without
//! duplicates and stay.

use hyd_index::TypedIndex;
use hyd_instance::InstId;
use hyd_source::{Diagnostic, Span};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::expressions::jump::JumpKey;
use crate::expressions::sample::SampleKey;
use crate::functions::draw::{Drawn, Place, Seeding};
use crate::model::{BlockId, ClockOperator, DelayBlock, EquationBlock, Message, UnitClaim, VarId, VariableBlock};
use crate::state::flattener::Flattener;

/// What an attempt has made, and what was said in it.
#[derive(Default)]
pub(crate) struct Draft {
    variables: Vec<VariableBlock>,
    scalars: u32,
    equations: Vec<EquationBlock>,
    delays: Vec<DelayBlock>,
    clocks: Vec<ClockOperator>,
    messages: Vec<Message>,
    claims: Vec<UnitClaim>,
    notes: Notes,
    said: Vec<Diagnostic>,
}

/// What one equation leaves for others to know.
#[derive(Default)]
pub(crate) struct Notes {
    /// Samples: the variable that says when they are due.
    pub samples: FxHashMap<SampleKey, VarId>,
    /// Integers with events at their jumps: the variable of each.
    pub jumps: Vec<(JumpKey, VarId)>,
    /// Variables made for derivatives that are differentiated.
    pub rates: FxHashMap<VarId, VarId>,
    /// Equations (places in the table that the notes belong to) whose values must be discrete-time expressions.
    pub discrete: Vec<usize>,
    /// Equations in a `when` of clocks: the first clock and how many there are.
    pub clocked: Vec<(usize, VarId, u32)>,
    /// Equations that terms can be injected into.
    pub injectable: Vec<usize>,
    /// Amplitudes declared, by the number of the term.
    pub amplitudes: Vec<(usize, VarId)>,
    /// Texts of the equations that terms were added to.
    pub injected: Vec<(usize, Span)>,
    /// `pre` outside of `when` of variables that no `when` has set so far.
    pub before_event: Vec<(Span, InstId)>,
    /// Where a `when` sets a whole variable.
    pub set_in_when: FxHashMap<InstId, Span>,
    /// Functions whose names have been looked at because a call failed.
    pub looked_at: FxHashSet<InstId>,
    /// Operands of the equations.
    pub operands: u64,
    /// Folds taken apart.
    pub folds: u32,
    /// `when` clauses met.
    pub whens: u32,
    /// States that were set of the generator of random numbers.
    pub seedings: Vec<Seeding>,
    /// Places that draw from it: the variable of the number.
    pub draws: FxHashMap<Place, VarId>,
    /// What they draw, in their order.
    pub drawn: Vec<Drawn>,
}

/// The tables that are written to now: those of the innermost attempt, or those of the model.
pub(crate) struct Tables<'a> {
    pub variables: &'a mut Vec<VariableBlock>,
    pub scalars: &'a mut u32,
    pub equations: &'a mut Vec<EquationBlock>,
    pub delays: &'a mut Vec<DelayBlock>,
    pub clocks: &'a mut Vec<ClockOperator>,
    pub messages: &'a mut Vec<Message>,
    pub claims: &'a mut Vec<UnitClaim>,
    pub notes: &'a mut Notes,
}

impl Draft {
    /// The claims, if nothing else was made or said.
    pub(crate) fn only_claims(&self) -> Option<&[UnitClaim]> {
        let nothing = self.variables.is_empty() && self.equations.is_empty() && self.delays.is_empty();
        (nothing && self.clocks.is_empty() && self.messages.is_empty() && self.said.is_empty()).then_some(&self.claims)
    }
}

impl Notes {
    /// Adds later notes; `places` says where the equations of theirs stand now.
    fn add(&mut self, later: Notes, places: impl Fn(usize) -> usize) {
        let Notes {
            samples,
            jumps,
            rates,
            discrete,
            clocked,
            injectable,
            amplitudes,
            injected,
            before_event,
            set_in_when,
            looked_at,
            operands,
            folds,
            whens,
            seedings,
            draws,
            drawn,
        } = later;
        self.samples.extend(samples);
        self.jumps.extend(jumps);
        self.rates.extend(rates);
        let new = |known: &[usize], at: &usize| known.last() != Some(at);
        for at in discrete.into_iter().map(&places) {
            if new(&self.discrete, &at) {
                self.discrete.push(at);
            }
        }
        for (at, clock, count) in clocked {
            let at = places(at);
            if self.clocked.last().is_none_or(|last| last.0 != at) {
                self.clocked.push((at, clock, count));
            }
        }
        for at in injectable.into_iter().map(&places) {
            if new(&self.injectable, &at) {
                self.injectable.push(at);
            }
        }
        self.amplitudes.extend(amplitudes);
        self.injected.extend(injected);
        self.before_event.extend(before_event);
        self.set_in_when.extend(set_in_when);
        self.looked_at.extend(looked_at);
        self.operands += operands;
        self.folds += folds;
        self.whens += whens;
        self.seedings.extend(seedings);
        self.draws.extend(draws);
        self.drawn.extend(drawn);
    }
}

impl Flattener<'_, '_> {
    /// Runs `body` as an attempt: what it makes is in the draft and nowhere else.
    pub(crate) fn attempt<T>(&mut self, body: impl FnOnce(&mut Self) -> T) -> (T, Draft) {
        self.scopes.table.messages.begin();
        self.drafts.push(Draft::default());
        let outcome = body(self);
        let mut draft = self.drafts.pop().expect("invariant: pushed above, and attempts end in order");
        draft.said = self.scopes.table.messages.end();
        (outcome, draft)
    }

    /// The answer to a question; what is made on the way, and said, is dropped.
    pub(crate) fn quietly<T>(&mut self, question: impl FnOnce(&mut Self) -> T) -> T {
        let met = self.draws_met.clone();
        let answer = self.attempt(question).0;
        self.draws_met = met;
        answer
    }

    /// Keeps what an attempt has made.
    pub(crate) fn keep(&mut self, draft: Draft) {
        let Draft { variables, scalars, equations, delays, clocks, messages, claims, notes, said } = draft;
        self.scopes.table.messages.report_all(said);
        let tables = self.tables();
        tables.variables.extend(variables);
        *tables.scalars += scalars;
        tables.delays.extend(delays);
        tables.clocks.extend(clocks);
        tables.messages.extend(messages);
        tables.claims.extend(claims);
        let before = tables.equations.len();
        let mut equations = equations.into_iter();
        let joined = equations.next().is_some_and(|first| !append(tables.equations, first));
        tables.equations.extend(equations);
        tables.notes.add(notes, |place| before + place - usize::from(joined));
    }

    /// The tables that are written to now.
    pub(crate) fn tables(&mut self) -> Tables<'_> {
        match self.drafts.last_mut() {
            Some(draft) => Tables {
                variables: &mut draft.variables,
                scalars: &mut draft.scalars,
                equations: &mut draft.equations,
                delays: &mut draft.delays,
                clocks: &mut draft.clocks,
                messages: &mut draft.messages,
                claims: &mut draft.claims,
                notes: &mut draft.notes,
            },
            None => Tables {
                variables: &mut self.model.variables.raw,
                scalars: &mut self.model.scalars,
                equations: &mut self.model.equations,
                delays: &mut self.model.delays,
                clocks: &mut self.model.clocks,
                messages: &mut self.model.messages,
                claims: &mut self.model.claims,
                notes: &mut self.notes,
            },
        }
    }

    /// All notes, those of the innermost attempt first.
    pub(crate) fn all_notes(&self) -> impl Iterator<Item = &Notes> {
        self.drafts.iter().rev().map(|draft| &draft.notes).chain([&self.notes])
    }

    /// Adds variables; they are numbered from [`Self::scalars`] on.
    pub(crate) fn add_variables(&mut self, block: VariableBlock) -> BlockId {
        let below: usize = self.drafts.iter().map(|draft| draft.variables.len()).sum();
        let id = BlockId::new(self.model.variables.len() + below);
        let tables = self.tables();
        *tables.scalars += block.count;
        tables.variables.push(block);
        id
    }

    /// Number of scalar variables so far.
    pub(crate) fn scalars(&self) -> u32 {
        self.model.scalars + self.drafts.iter().map(|draft| draft.scalars).sum::<u32>()
    }

    /// The block of a scalar variable and its position in it.
    pub(crate) fn locate(&self, v: VarId) -> (BlockId, usize) {
        if v.0 < self.model.scalars || self.drafts.is_empty() {
            return self.model.locate(v);
        }
        let mut below = self.model.variables.len();
        let mut found = None;
        for draft in &self.drafts {
            if let Some(k) = draft.variables.partition_point(|block| block.first <= v).checked_sub(1) {
                found = Some((BlockId::new(below + k), (v.0 - draft.variables[k].first.0) as usize));
            }
            below += draft.variables.len();
        }
        found.unwrap_or_else(|| self.model.locate(v))
    }

    /// A block of variables.
    pub(crate) fn variable(&self, block: BlockId) -> &VariableBlock {
        let mut at = block.index();
        if at < self.model.variables.len() {
            return &self.model.variables[block];
        }
        at -= self.model.variables.len();
        for draft in &self.drafts {
            if let Some(found) = draft.variables.get(at) {
                return found;
            }
            at -= draft.variables.len();
        }
        panic!("invariant: blocks are numbered by the attempts that hold them")
    }

    /// The block of a scalar variable.
    pub(crate) fn variable_of(&self, v: VarId) -> &VariableBlock {
        self.variable(self.locate(v).0)
    }

    /// The block added last by this attempt.
    pub(crate) fn newest(&mut self) -> Option<&mut VariableBlock> {
        self.tables().variables.last_mut()
    }

    /// The text added last by this attempt and its number.
    pub(crate) fn newest_message(&self) -> Option<(u32, &Message)> {
        let newest = self.drafts.last().map_or(&self.model.messages, |draft| &draft.messages).last()?;
        Some((self.text_messages() - 1, newest))
    }

    /// A text by its number.
    pub(crate) fn message_mut(&mut self, number: u32) -> Option<&mut Message> {
        let mut at = number as usize;
        let tables = std::iter::once(&mut self.model.messages).chain(self.drafts.iter_mut().map(|d| &mut d.messages));
        for messages in tables {
            if at < messages.len() {
                return messages.get_mut(at);
            }
            at -= messages.len();
        }
        None
    }

    fn text_messages(&self) -> u32 {
        (self.model.messages.len() + self.drafts.iter().map(|draft| draft.messages.len()).sum::<usize>()) as u32
    }

    /// Adds a text of an `assert` or `terminate` and returns its number.
    pub(crate) fn add_message(&mut self, message: Message) -> u32 {
        self.tables().messages.push(message);
        self.text_messages() - 1
    }

    /// Number of delay sites so far.
    pub(crate) fn delay_sites(&self) -> u32 {
        let newest = self.drafts.iter().rev().find_map(|draft| draft.delays.last());
        newest.map_or_else(|| self.model.delay_sites(), |block| block.first + block.count)
    }

    /// The claim at a place, counted through the model and all attempts.
    pub(crate) fn claim_at(&self, mut place: usize) -> Option<&UnitClaim> {
        for claims in std::iter::once(&self.model.claims).chain(self.drafts.iter().map(|draft| &draft.claims)) {
            if let Some(found) = claims.get(place) {
                return Some(found);
            }
            place -= claims.len();
        }
        None
    }

    /// How many claims there are.
    pub(crate) fn claims(&self) -> usize {
        self.model.claims.len() + self.drafts.iter().map(|draft| draft.claims.len()).sum::<usize>()
    }
}

/// Adds equations; those that continue the block before them, as the turns of a loop that had to be run through do, become part of it.
/// True if they are a block of their own.
pub(crate) fn append(equations: &mut Vec<EquationBlock>, block: EquationBlock) -> bool {
    if let Some(last) = equations.last_mut()
        && (last.section, last.template, last.made, block.made) == (block.section, block.template, false, false)
        && last.origin == block.origin
    {
        last.count += block.count;
        last.operands.extend(block.operands);
        return false;
    }
    equations.push(block);
    true
}
