//! What code is made from: kernels of expressions over addresses, without any name of a variable.
//!
//! A [`Program`] is a list of routines, a routine a list of kernels that run one after the other, and a kernel a set of
//! expressions computed for one set of slots, or for many sets in a loop.  All loads of one instance see memory as it was
//! before that instance; instances of a loop do not depend on each other.

use hyd_index::{IndexVec, typed_index};
use hyd_symbolic::{Arena, NodeId};

typed_index!(
    /// A routine of a program.
    RoutineId,
    "routine"
);

/// The memory areas a routine sees, each an array of `f64`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
#[repr(u8)]
pub enum Area {
    /// Time, flags, constants, parameters, start values, discrete variables, held relations: fixed within a step.
    Data = 0,
    /// Unknowns `y` (or `z` of the initial system).
    Unknown = 1,
    /// Derivatives `y'`.
    Rate = 2,
    /// Assigned variables.
    Work = 3,
    /// Results of the routine.
    Out = 4,
    /// Second result array (dF/dy' beside dF/dy).
    Out2 = 5,
}

/// A position in an area.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
pub struct Place {
    /// Area.
    pub area: Area,
    /// Position.
    pub index: u32,
}

impl Place {
    /// A position in the data area.
    pub fn data(index: u32) -> Self {
        Self { area: Area::Data, index }
    }
}

/// Number of areas.
pub const AREAS: usize = 6;

/// Where one slot of a kernel reads or writes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Address {
    /// The same place in every instance.
    Fixed {
        /// Area.
        area: Area,
        /// Position.
        index: u32,
        /// Read as its negative.
        negated: bool,
    },
    /// Instance `k` uses position `base + stride*k`.
    Affine {
        /// Area.
        area: Area,
        /// Position of instance 0.
        base: u32,
        /// Step per instance.
        stride: i32,
        /// Read as its negative.
        negated: bool,
    },
    /// Instance `k` uses the position in `Program::tables[start + k]`; its highest bit negates the value if `signed`.
    Table {
        /// Area.
        area: Area,
        /// First entry of the table.
        start: u32,
        /// Entries carry signs.
        signed: bool,
    },
}

/// The sign bit of a table entry.
pub const TABLE_SIGN: u32 = 1 << 31;

/// A computed value and where it goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Store {
    /// The expression; its slots are positions in `Kernel::slots`.
    pub value: NodeId,
    /// Where the value is written (never negated).
    pub to: Address,
}

/// Expressions computed together.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Kernel {
    /// Number of instances; 1 for straight-line code.
    pub count: u32,
    /// What each slot reads.
    pub slots: Vec<Address>,
    /// What is computed.
    pub stores: Vec<Store>,
}

/// A callable piece of the program.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Routine {
    /// Name, for listings.
    pub name: &'static str,
    /// Kernels in the order they run.
    pub kernels: Vec<Kernel>,
}

/// Everything that is turned into code.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Expressions of all kernels. `Node::Time`, `Node::Initial` and `Node::Homotopy` read `Data[TIME]` and so on;
    /// there are no `Node::Event` nodes left.
    pub arena: Arena,
    /// Routines.
    pub routines: IndexVec<RoutineId, Routine>,
    /// Slot tables of the loops.
    pub tables: Vec<u32>,
}

/// Position of the time in the data area.
pub const TIME: u32 = 0;
/// Position of the `initial()` flag in the data area.
pub const INITIAL: u32 = 1;
/// Position of the share of `homotopy` that is actual.
pub const HOMOTOPY: u32 = 2;
