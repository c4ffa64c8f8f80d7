//! What annotations draw: lines, rectangles, ellipses, polygons, texts, pictures (Modelica 3.6, section 18.6.5), as plain data.

use super::geometry::{Extent, Point};

/// Red, green, blue.
pub(crate) type Color = [u8; 3];

pub(crate) const BLACK: Color = [0, 0, 0];

/// How a line is dashed; none: it is not drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Stroke {
    None,
    Solid,
    Dash,
    Dot,
    DashDot,
    DashDotDot,
}

/// How an area is filled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Fill {
    None,
    Solid,
    Horizontal,
    Vertical,
    Cross,
    Forward,
    Backward,
    CrossDiagonal,
    HorizontalCylinder,
    VerticalCylinder,
    Sphere,
}

/// Where a text stands in its box.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Align {
    Left,
    Center,
    Right,
}

/// The form of a graphic.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Form {
    Line {
        points: Vec<Point>,
        smooth: bool,
        arrows: [bool; 2],
    },
    Polygon {
        points: Vec<Point>,
        smooth: bool,
    },
    Rectangle {
        extent: Extent,
        radius: f64,
    },
    Ellipse {
        extent: Extent,
        angles: (f64, f64),
        pie: bool,
    },
    Text {
        extent: Extent,
        text: String,
        size: f64,
        align: Align,
        bold: bool,
        italic: bool,
    },
    /// A picture that the annotation holds itself, as base64.
    Picture {
        extent: Extent,
        data: String,
    },
}

/// Something that is drawn.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Graphic {
    pub(crate) form: Form,
    pub(crate) origin: Point,
    /// Degrees, counter-clockwise.
    pub(crate) rotation: f64,
    pub(crate) color: Color,
    pub(crate) fill_color: Color,
    pub(crate) dash: Stroke,
    pub(crate) fill: Fill,
    /// In mm on paper.
    pub(crate) thickness: f64,
}

/// Where a component is placed: its icon is mapped onto the box, turned, and moved to the origin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Placement {
    pub(crate) origin: Point,
    pub(crate) extent: Extent,
    pub(crate) rotation: f64,
}

/// What a class looks like.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Icon {
    /// The coordinates that it is drawn in.
    pub(crate) extent: Extent,
    /// Bases first.
    pub(crate) graphics: Vec<Graphic>,
}

/// The box of an icon or diagram where nothing else is said.
pub(crate) fn default_extent() -> Extent {
    Extent::new(-100.0, -100.0, 100.0, 100.0)
}
