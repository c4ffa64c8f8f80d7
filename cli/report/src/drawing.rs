//! A finished picture as a flat list of shapes: what SVG and PNG are both made from.
//!
//! Coordinates are in pixels of 1/96 inch, the origin is the upper left corner, y points down.  Later shapes lie over
//! earlier ones; the background is white.

/// An opaque colour: red, green, blue.
pub(crate) type Colour = [u8; 3];

/// How a line is drawn.
#[derive(Clone, PartialEq, Debug)]
pub struct Stroke {
    /// Colour.
    pub colour: Colour,
    /// Width in pixels.
    pub width: f64,
    /// Lengths of strokes and gaps in pixels; empty for a solid line.
    pub dash: &'static [f64],
}

/// Which point of a text stands at its position.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// One shape.
#[derive(Clone, PartialEq, Debug)]
pub enum Shape {
    /// Lines through points; several pieces share a stroke.  A piece of one point is a dot.
    Lines {
        /// The pieces.
        pieces: Vec<Vec<(f64, f64)>>,
        /// How they are drawn.
        stroke: Stroke,
    },
    /// One line of text on a base line.
    Text {
        /// Position of the anchor on the base line.
        at: (f64, f64),
        /// The text.
        text: String,
        /// Height of the letter box (em) in pixels.
        size: f64,
        /// Which point stands at the position.
        anchor: Anchor,
        /// Read from bottom to top.
        upward: bool,
        /// Colour.
        colour: Colour,
    },
}

/// A picture.
#[derive(Clone, PartialEq, Debug)]
pub struct Drawing {
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// Shapes from back to front.
    pub shapes: Vec<Shape>,
}
