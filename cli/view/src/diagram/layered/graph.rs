//! What is laid out, and what comes of it.

use crate::diagram::End;
use crate::diagram::geometry::Point;

/// What is to be laid out.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    /// Least width and height of each box.
    pub(crate) boxes: Vec<(f64, f64)>,
    pub(crate) edges: Vec<(End, End)>,
}

/// Where a port of a box is drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Spot {
    pub(crate) end: End,
    pub(crate) at: Point,
    /// On the left of its box.
    pub(crate) is_left: bool,
}

/// What came of it; x to the right, y upwards.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    /// Centre and size of each box.
    pub(crate) boxes: Vec<(Point, f64, f64)>,
    pub(crate) spots: Vec<Spot>,
    /// Of each edge its corners, from its first end to its second.
    pub(crate) lines: Vec<Vec<Point>>,
}
