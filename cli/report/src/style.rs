//! Colours and dashes of curves, sizes of texts.
//!
//! The palette is that of Okabe and Ito, "Color Universal Design" (2008), without its yellow, which white paper swallows.

use crate::drawing::{Colour, Stroke};

pub(crate) const TEXT: Colour = [0x22, 0x22, 0x22];
pub(crate) const TEXT_SIZE: f64 = 12.0;
pub(crate) const TITLE_SIZE: f64 = 14.0;

/// Blue, vermillion, bluish green, reddish purple, orange, sky blue, black.
const PALETTE: [Colour; 7] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
    [0x00, 0x00, 0x00],
];

const DASHES: [&[f64]; 5] = [&[], &[6.0, 3.0], &[2.0, 2.0], &[9.0, 3.0, 2.0, 3.0], &[12.0, 4.0]];

/// The line of the axes' frame and ticks.
pub(crate) const FRAME: Stroke = Stroke { colour: [0x44, 0x44, 0x44], width: 0.8, dash: &[] };

/// The line of the grid.
pub(crate) const GRID: Stroke = Stroke { colour: [0xE2, 0xE2, 0xE2], width: 0.7, dash: &[] };

/// How colour and dash tell variables and runs apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Coding {
    /// No panel shows more than one variable: colour and dash tell the run.
    ByRun,
    /// Colour tells the variable, dash the run.
    ByVariable,
}

/// The stroke of a curve: `variable` is its position in the panel.
pub(crate) fn curve_stroke(coding: Coding, variable: usize, run: usize) -> Stroke {
    let (colour, dash) = match coding {
        Coding::ByRun => (run, run),
        Coding::ByVariable => (variable, run + variable / PALETTE.len()),
    };
    Stroke { colour: PALETTE[colour % PALETTE.len()], width: 1.5, dash: DASHES[dash % DASHES.len()] }
}

/// The stroke that stands for a run in the legend.
pub(crate) fn run_stroke(coding: Coding, run: usize) -> Stroke {
    match coding {
        Coding::ByRun => curve_stroke(coding, 0, run),
        Coding::ByVariable => Stroke { colour: FRAME.colour, ..curve_stroke(coding, 0, run) },
    }
}
