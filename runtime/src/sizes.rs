//! Sizes of states without a nominal value, learned from the run.
//!
//! An absolute tolerance of 1 times the relative one suits a state of size 1.  For a lift of 4 mm in metres it allows 2.5e-4 of the motion at
//! a tolerance of 1e-6.  The size that counts beside a value is therefore a part of the largest value so far, never more than the usual 1,
//! and never so little that the noise of a state at rest would be followed.  Elements of an array share one size: some of them may still be
//! at rest where a wave comes to others.  Only values of accepted steps count, so that a run gives the same bits every time; algebraic
//! unknowns keep 1: one that is the difference of large values has the rounding errors of these, and no step makes them smaller.

use hyd_system::LearnedSize;

/// Part of the largest value so far that counts as the size.  At equal error the work is the same from 0.01 to 1; this one makes errors at
/// a given tolerance about as small as nominal values that somebody states with care.
const PART: f64 = 0.1;
/// The least size.  With less, circuits that switch at the edge of a solution fail more often, and small motions gain nothing.
const LEAST: f64 = 1e-3;
/// No absolute tolerance below this is made of a size that was learned.
const LEAST_ALLOWED: f64 = 1e-12;
/// The size of what is not learned and has no nominal value, and the largest that is learned: tolerances become tighter, never wider.
const USUAL: f64 = 1.0;

/// What has been learned so far.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct LearnedSizes {
    /// Unknowns, each with its group.
    members: Vec<(u32, u32)>,
    /// The largest value so far in each group.
    largest: Vec<f64>,
    least: f64,
}

impl LearnedSizes {
    /// Nothing is learned.
    pub(crate) fn clear(&mut self) {
        self.members.clear();
        self.largest.clear();
    }

    /// Learns the sizes of these unknowns from here on, as far as the present one is the usual one; they begin with the least.
    pub(crate) fn begin(&mut self, wanted: &[LearnedSize], tolerance: f64, sizes: &mut [f64]) {
        self.clear();
        self.least = LEAST.max(LEAST_ALLOWED / tolerance).min(USUAL);
        let usual = wanted.iter().filter(|size| sizes[size.unknown as usize] == USUAL);
        self.members.extend(usual.map(|size| (size.unknown, size.group)));
        let groups = self.members.iter().map(|&(_, group)| group as usize + 1).max();
        self.largest.resize(groups.unwrap_or(0), 0.0);
        for &(unknown, _) in &self.members {
            sizes[unknown as usize] = self.least;
        }
    }

    /// Takes accepted values into account.
    #[inline(always)]
    pub(crate) fn see(&mut self, y: &[f64], sizes: &mut [f64]) {
        if !self.members.is_empty() {
            self.compare(y, sizes);
        }
    }

    #[inline(never)]
    fn compare(&mut self, y: &[f64], sizes: &mut [f64]) {
        let mut has_grown = false;
        for &(unknown, group) in &self.members {
            let (value, largest) = (y[unknown as usize].abs(), &mut self.largest[group as usize]);
            // A NaN is not larger.
            if value > *largest {
                *largest = value;
                has_grown = true;
            }
        }
        if has_grown {
            for &(unknown, group) in &self.members {
                sizes[unknown as usize] = (PART * self.largest[group as usize]).clamp(self.least, USUAL);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use hyd_system::LearnedSize;

    use super::LearnedSizes;

    const WANTED: [LearnedSize; 3] = [
        LearnedSize { unknown: 0, group: 0 },
        LearnedSize { unknown: 2, group: 1 },
        LearnedSize { unknown: 3, group: 1 },
    ];

    #[test]
    fn sizes_follow_the_largest_value_of_a_group_between_limits() {
        let (mut learned, mut sizes) = (LearnedSizes::default(), [1.0, 1.0, 1.0, 1.0]);
        learned.begin(&WANTED, 1e-6, &mut sizes);
        assert_eq!(sizes, [1e-3, 1.0, 1e-3, 1e-3]);
        // The second one is not learned; the largest of a group counts for all of it; a NaN does not.
        learned.see(&[-4e-2, 5e-3, 0.0, 0.5], &mut sizes);
        learned.see(&[1e-3, 5e-3, f64::NAN, 0.25], &mut sizes);
        assert_eq!(sizes, [0.1 * 4e-2, 1.0, 0.1 * 0.5, 0.1 * 0.5]);
        learned.see(&[-1e5, 5e-3, 0.0, 0.0], &mut sizes);
        assert_eq!(sizes, [1.0, 1.0, 0.1 * 0.5, 0.1 * 0.5]);
    }

    #[test]
    fn a_stated_size_stays_and_tight_tolerances_keep_sizes_up() {
        let (mut learned, mut sizes) = (LearnedSizes::default(), [20.0, 1.0, 1.0, 1.0]);
        learned.begin(&WANTED, 1e-10, &mut sizes);
        assert_eq!(sizes, [20.0, 1.0, 1e-2, 1e-2]);
        learned.see(&[3.0, 3.0, 3e-3, 0.0], &mut sizes);
        assert_eq!(sizes, [20.0, 1.0, 1e-2, 1e-2]);
        learned.begin(&WANTED, 1e-13, &mut sizes);
        learned.see(&[3.0, 3.0, 3e-3, 0.0], &mut sizes);
        assert_eq!(sizes[2..], [1e-2, 1e-2], "what is not the usual size any more is not learned");
    }
}
