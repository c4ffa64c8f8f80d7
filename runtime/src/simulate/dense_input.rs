//! Do jumps of recorded inputs need rows of their own?
//!
//! An event has a row before it and one after it.  Where held values of a recorded input follow each other as closely as the output points do,
//! these show what there is, and two rows more for each sample would make a file three times as long.

/// So many values in a row that follow each other within this many output intervals have no rows of their own.
const MANY: u32 = 16;
const WITHIN: f64 = 2.0;

/// Values of recorded inputs that have been taken up.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct DenseInput {
    /// Time of the last one (s).
    last: f64,
    /// How many have followed each other closely.
    close: u32,
}

impl DenseInput {
    /// None yet.
    pub(super) const NONE: Self = Self { last: f64::NEG_INFINITY, close: 0 };

    /// Takes in a jump at `t` (s) where output points are `interval` (s) apart; true if it needs no rows.
    pub(super) fn jump(&mut self, t: f64, interval: f64) -> bool {
        let is_close = t - self.last < WITHIN * interval;
        self.close = if is_close { self.close.saturating_add(1) } else { 0 };
        self.last = t;
        self.close >= MANY
    }
}

#[cfg(test)]
mod tests {
    use super::DenseInput;

    #[test]
    fn only_many_values_that_follow_closely_have_no_rows() {
        let mut input = DenseInput::NONE;
        let bare: Vec<bool> = (0..40).map(|k| input.jump(f64::from(k), 1.0)).collect();
        assert_eq!(bare.iter().position(|&bare| bare), Some(16));
        assert!(bare[16..].iter().all(|&bare| bare));
        // After a pause an edge is an edge again, and pulses far apart always are.
        assert!(!input.jump(50.0, 1.0) && !input.jump(51.0, 1.0));
        assert!((0..40).all(|k| !input.jump(100.0 + 3.0 * f64::from(k), 1.0)));
    }
}
