//! Results of runs as pictures: curves over time in, SVG or PNG out.
//!
//! A [`Figure`] says what to show (panels of curves that share the time axis), [`Figure::draw`] lays it out as a [`Drawing`]
//! of lines and texts, and the drawing becomes SVG text or a PNG image.  Both come from the same list of shapes, so they
//! look alike; the PNG brings its own font and needs none on the machine.  Colours are those of Okabe and Ito ("Color
//! Universal Design", 2008), which people with colour-vision deficiency can tell apart.  Nothing is computed about the
//! results here beyond what a reader's eye needs: ranges, ticks, thinning of points below a pixel.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod decimal;
mod drawing;
mod figure;
mod font;
mod layout;
mod png;
mod simplify;
mod style;
mod svg;
mod ticks;
mod units;

#[cfg(test)]
mod tests;

pub use drawing::{Anchor, Drawing, Shape, Stroke};
pub use figure::{Curve, Figure, Panel};
pub use png::PngError;
pub use simplify::simplify;
pub use ticks::{Ticks, ticks};
pub use units::{Scale, pretty_unit, scale};
