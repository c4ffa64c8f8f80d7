//! The past of delayed expressions: pieces of parabolas between the steps.

/// One step of the past.
struct Piece {
    start: f64,
    end: f64,
    values: [f64; 3],
}

/// The past of one `delay`.
#[derive(Default)]
pub(super) struct Past {
    first: f64,
    pieces: Vec<Piece>,
}

/// Times closer than this are the same (s).
const SAME: f64 = 1e-12;

impl Past {
    /// What was before the start.
    pub(super) fn begin(&mut self, value: f64) {
        self.first = value;
        self.pieces.clear();
    }

    /// The values at the start, in the middle and at the end of a step.  Before the start the value was that which the run begins
    /// with, after the events at the start: `expr(time.start)` of 3.7.4.1 is what the variable shows from then on.
    pub(super) fn add(&mut self, start: f64, end: f64, values: [f64; 3]) {
        if self.pieces.is_empty() {
            self.first = values[0];
        }
        self.pieces.push(Piece { start, end, values });
    }

    /// The value at a time; at a jump the one that comes after it, or the one before.
    pub(super) fn value(&self, time: f64, after: bool) -> f64 {
        let piece = match after {
            true => self.pieces.iter().rev().find(|piece| piece.start <= time + SAME),
            false => {
                self.pieces.iter().find(|piece| piece.end >= time - SAME).filter(|piece| piece.start < time - SAME)
            }
        };
        let Some(Piece { start, end, values: [a, m, b] }) = piece else { return self.first };
        let s = (time - start) / (end - start);
        a * (1.0 - s) * (1.0 - 2.0 * s) + m * 4.0 * s * (1.0 - s) + b * s * (2.0 * s - 1.0)
    }
}
