//! Numbers and truths in the two widths of generated code: one at a time, or two in a vector.
//!
//! A truth beside one number is a byte of 0 or 1, beside two it is a mask of 64 ones or zeros per lane.  Everything
//! that has the same instruction for both widths is emitted by [`super::expression`]; here is what differs.

use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value, types};
use cranelift_frontend::FunctionBuilder;

/// How many instances a value holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Width {
    /// One number.
    One,
    /// Two numbers.
    Two,
}

impl Width {
    /// The same number for all instances.
    pub(super) fn number(self, fb: &mut FunctionBuilder<'_>, number: f64) -> Value {
        let value = fb.ins().f64const(number);
        self.spread(fb, value)
    }

    /// A scalar for all instances.
    pub(super) fn spread(self, fb: &mut FunctionBuilder<'_>, value: Value) -> Value {
        match self {
            Self::One => value,
            Self::Two => fb.ins().splat(types::F64X2, value),
        }
    }

    /// The number `a` where the truth holds, else `b`.
    pub(super) fn select(self, fb: &mut FunctionBuilder<'_>, truth: Value, a: Value, b: Value) -> Value {
        match self {
            Self::One => fb.ins().select(truth, a, b),
            Self::Two => {
                let mask = fb.ins().bitcast(types::F64X2, MemFlagsData::new(), truth);
                fb.ins().bitselect(mask, a, b)
            }
        }
    }

    /// The truth `a` where the first one holds, else `b`.
    pub(super) fn select_truth(self, fb: &mut FunctionBuilder<'_>, truth: Value, a: Value, b: Value) -> Value {
        match self {
            Self::One => fb.ins().select(truth, a, b),
            Self::Two => fb.ins().bitselect(truth, a, b),
        }
    }

    /// The opposite of a truth.
    pub(super) fn not(self, fb: &mut FunctionBuilder<'_>, truth: Value) -> Value {
        match self {
            Self::One => fb.ins().bxor_imm_u(truth, 1),
            Self::Two => fb.ins().bnot(truth),
        }
    }
}
