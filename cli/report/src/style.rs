//! Colours and dashes of curves, sizes of texts.
//!
//! The palette is that of Okabe and Ito, "Color Universal Design" (2008), without its yellow, which white paper swallows; for the same
//! reason the ramp of a family, after viridis (Smith, van der Walt 2015), ends before yellow.

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

/// Colours of a family from its first run to its last one.
const RAMP: [Colour; 4] = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98]];

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
    /// Colour tells where a run stands among so many.
    Family(usize),
}

/// The stroke of a curve: `variable` is its position in the panel.
pub(crate) fn curve_stroke(coding: Coding, variable: usize, run: usize) -> Stroke {
    let (colour, dash) = match coding {
        Coding::ByRun => (run, run),
        Coding::ByVariable => (variable, run + variable / PALETTE.len()),
        Coding::Family(runs) => return Stroke { colour: ramp(run, runs), width: 1.0, dash: &[] },
    };
    Stroke { colour: PALETTE[colour % PALETTE.len()], width: 1.5, dash: DASHES[dash % DASHES.len()] }
}

/// The stroke that stands for a run in the legend.
pub(crate) fn run_stroke(coding: Coding, run: usize) -> Stroke {
    match coding {
        Coding::ByRun | Coding::Family(_) => curve_stroke(coding, 0, run),
        Coding::ByVariable => Stroke { colour: FRAME.colour, ..curve_stroke(coding, 0, run) },
    }
}

/// The colour of a run of a family.
fn ramp(run: usize, runs: usize) -> Colour {
    let place = run as f64 / runs.saturating_sub(1).max(1) as f64 * (RAMP.len() - 1) as f64;
    let below = (place as usize).min(RAMP.len() - 2);
    let share = (place - below as f64).clamp(0.0, 1.0);
    let mixed = |k: usize| f64::from(RAMP[below][k]) * (1.0 - share) + f64::from(RAMP[below + 1][k]) * share;
    [0, 1, 2].map(|k| mixed(k).round() as u8)
}
