//! One step of the elimination along a list of operations.

/// One elimination step: where it stands in the lists.
#[derive(Clone, Copy, Default, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Pivot {
    pub(super) row: u32,
    pub(super) column: u32,
    /// Position of the pivot; its row of U follows, then its column of L.
    pub(super) at: u32,
    /// Numbers of entries in both.
    pub(super) upper: u32,
    pub(super) lower: u32,
    /// Where its targets begin.
    pub(super) targets: u32,
    /// Size, relative to the largest of its row, below which it counts as vanished.
    pub(super) floor: f64,
}
