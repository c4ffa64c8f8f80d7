//! What stands in a slot of an equation: a variable, a rate, a number, a place that the run fills; with its sign in four bytes.

use crate::model::{ConstId, VarId};

/// What stands in a slot.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
pub enum Target {
    /// The value of a variable.
    Var(VarId),
    /// Its time derivative.
    Der(VarId),
    /// Its value before the event (`pre`).
    Pre(VarId),
    /// Its start attribute.
    Start(VarId),
    /// A number of the pool (a loop index, an evaluated structural value).
    Const(ConstId),
    /// Truth of a relation as held since the last event (index of the relation; used behind the flat model only).
    Held(u32),
    /// 1 while a candidate is a state, else 0 (index of the choice; data that may change during the run; used behind the flat
    /// model only).
    Chosen(u32),
    /// The delayed value of a site ([`DelayBlock`]); where the delay time varies, the value plus rate times delay time.
    Delayed(u32),
    /// The rate of the source of a site at the delayed time.
    DelayedRate(u32),
    /// The value of an input that follows recorded samples ([`DrivenBlock`]).
    Input(u32),
    /// Its time derivative.
    InputRate(u32),
}

/// A target with a sign, packed into four bytes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Operand(u32);

impl Operand {
    const INDEX_BITS: u32 = 28;
    const MASK: u32 = (1 << Self::INDEX_BITS) - 1;
    /// Largest number of variables a model may have.
    pub const LIMIT: usize = Self::MASK as usize;

    /// The target itself.
    pub fn new(target: Target) -> Self {
        let (kind, index) = match target {
            Target::Var(v) => (0, v.0),
            Target::Der(v) => (1, v.0),
            Target::Pre(v) => (2, v.0),
            Target::Start(v) => (3, v.0),
            Target::Const(c) => (4, c.0),
            Target::Held(r) => (5, r),
            Target::Chosen(k) => (6, k),
            Target::Delayed(site) => (7, 4 * site),
            Target::DelayedRate(site) => (7, 4 * site + 1),
            Target::Input(k) => (7, 4 * k + 2),
            Target::InputRate(k) => (7, 4 * k + 3),
        };
        debug_assert!(index <= Self::MASK, "invariant: checked against Operand::LIMIT when variables are made");
        Self(kind << (Self::INDEX_BITS + 1) | index & Self::MASK)
    }

    /// The negative of it.
    pub fn negate(self) -> Self {
        Self(self.0 ^ 1 << Self::INDEX_BITS)
    }

    /// Negated if `flip`.
    pub fn signed(self, flip: bool) -> Self {
        if flip { self.negate() } else { self }
    }

    /// True when the slot reads the negative of the target.
    pub fn negated(self) -> bool {
        self.0 >> Self::INDEX_BITS & 1 == 1
    }

    /// The target.
    pub fn target(self) -> Target {
        let index = self.0 & Self::MASK;
        match self.0 >> (Self::INDEX_BITS + 1) {
            0 => Target::Var(VarId(index)),
            1 => Target::Der(VarId(index)),
            2 => Target::Pre(VarId(index)),
            3 => Target::Start(VarId(index)),
            4 => Target::Const(ConstId(index)),
            5 => Target::Held(index),
            6 => Target::Chosen(index),
            _ => match index & 3 {
                0 => Target::Delayed(index / 4),
                1 => Target::DelayedRate(index / 4),
                2 => Target::Input(index / 4),
                _ => Target::InputRate(index / 4),
            },
        }
    }
}

impl std::fmt::Debug for Operand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{:?}", if self.negated() { "-" } else { "" }, self.target())
    }
}
