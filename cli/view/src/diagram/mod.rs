//! The diagrams of a model: its parts, what connects them, what they look like and where they stand, as plain data.
//!
//! `extract` reads them from the instances of a model and from annotations (`annotation`, `graphic`); `layered` places what no annotation places,
//! `detour` leads lines that no annotation draws around what annotations place, `arrange` puts all together into places and lines, `labels` finds room for values, `svg` makes the picture.

pub(crate) mod annotation;
pub(crate) mod arrange;
pub(crate) mod detour;
pub(crate) mod extract;
pub(crate) mod geometry;
pub(crate) mod graphic;
pub(crate) mod labels;
pub(crate) mod layered;
pub(crate) mod svg;
pub(crate) mod text;

use geometry::{Extent, Point};
use graphic::{Color, Graphic, Icon, Placement};

/// The inside of a component that has parts.
#[derive(Debug)]
pub(crate) struct Diagram {
    /// Instance path, empty for the model itself.
    pub(crate) path: String,
    /// Full name of its class.
    pub(crate) class: String,
    pub(crate) parts: Vec<Part>,
    pub(crate) wires: Vec<Wire>,
    /// The box and the graphics of the diagram itself.
    pub(crate) extent: Extent,
    pub(crate) graphics: Vec<Graphic>,
}

/// A component of a diagram.
#[derive(Debug)]
pub(crate) struct Part {
    /// Instance path; of an array that of its first element where these are instances of their own.
    pub(crate) path: String,
    /// With its sizes.
    pub(crate) name: String,
    /// Full name of its class.
    pub(crate) class: String,
    pub(crate) description: String,
    /// Where it is declared: file, line from 1, and what is written there.
    pub(crate) declared: (String, u32, String),
    /// It is a connector of what the diagram is of.
    pub(crate) is_connector: bool,
    pub(crate) placement: Option<Placement>,
    pub(crate) icon: Icon,
    pub(crate) ports: Vec<Port>,
}

/// A connector of a part.
#[derive(Debug)]
pub(crate) struct Port {
    pub(crate) name: String,
    /// In the icon of the part; none where no annotation says it.
    pub(crate) placement: Option<Placement>,
    /// Annotations place it, but do not show it.
    pub(crate) is_hidden: bool,
    pub(crate) is_output: bool,
    pub(crate) icon: Icon,
}

/// An end of a connection: the part, and its connector where it is none itself.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct End {
    pub(crate) part: usize,
    pub(crate) port: Option<usize>,
}

/// A connection.
#[derive(Debug)]
pub(crate) struct Wire {
    pub(crate) from: End,
    pub(crate) to: End,
    /// The ends as they are written.
    pub(crate) written: [String; 2],
    /// From an annotation.
    pub(crate) points: Option<Vec<Point>>,
    pub(crate) color: Option<Color>,
    /// Full names of the variables that the connection makes equal, then those that it adds up.
    pub(crate) values: Vec<String>,
}
