//! The pattern of the iteration matrix and the maps of its two parts into it.
//!
//! Combinations `a_j dF/dy_j + b_j dF/dy'_j` of columns have the union of the two parts as their pattern; positions are looked up once.

use hyd_system::Pattern;

/// Union of two square patterns with the position of each entry of both in it.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct MergedPattern {
    /// The union.
    pub(super) pattern: Pattern,
    state_positions: Vec<u32>,
    rate_positions: Vec<u32>,
}

impl MergedPattern {
    /// Merges the patterns of dF/dy and dF/dy'.
    pub(super) fn new(state: &Pattern, rate: &Pattern) -> Self {
        let n = state.columns();
        let mut pairs = Vec::with_capacity(state.entries() + rate.entries());
        for part in [state, rate] {
            for c in 0..part.columns() {
                pairs.extend(part.column(c).map(|e| (part.row_indices[e], c as u32)));
            }
        }
        let pattern = Pattern::from_pairs(state.rows, n, &pairs);
        let state_positions = positions(&pattern, state);
        let rate_positions = positions(&pattern, rate);
        Self { pattern, state_positions, rate_positions }
    }

    /// `values := dF/dy + c dF/dy'` on the union.
    pub(super) fn combine(&self, state: &[f64], rate: &[f64], c: f64, values: &mut [f64]) {
        values.fill(0.0);
        for (&position, &value) in self.state_positions.iter().zip(state) {
            values[position as usize] += value;
        }
        for (&position, &value) in self.rate_positions.iter().zip(rate) {
            values[position as usize] += c * value;
        }
    }

    /// Columns of dF/dy' for differential unknowns and of dF/dy for the others, on the union; `state_pattern` and
    /// `rate_pattern` are the parts given to `new`.
    pub(super) fn select(
        &self,
        parts: (&Pattern, &Pattern),
        state: &[f64],
        rate: &[f64],
        differential: &[bool],
        values: &mut [f64],
    ) {
        values.fill(0.0);
        for (column, &is_differential) in differential.iter().enumerate() {
            let (pattern, positions, source) = if is_differential {
                (parts.1, &self.rate_positions, rate)
            } else {
                (parts.0, &self.state_positions, state)
            };
            for entry in pattern.column(column) {
                values[positions[entry] as usize] += source[entry];
            }
        }
    }
}

/// Position in `union` of each entry of `part`, whose rows ascend within columns.
fn positions(union: &Pattern, part: &Pattern) -> Vec<u32> {
    let mut found = Vec::with_capacity(part.entries());
    for c in 0..part.columns() {
        let range = union.column(c);
        for entry in part.column(c) {
            let row = part.row_indices[entry];
            let offset = union.row_indices[range.clone()].partition_point(|&r| r < row);
            found.push((range.start + offset) as u32);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combination_and_selection_agree_with_dense_sums() {
        let state = Pattern::from_pairs(3, 3, &[(0, 0), (2, 0), (1, 1), (0, 2)]);
        let rate = Pattern::from_pairs(3, 3, &[(0, 0), (1, 0), (2, 2)]);
        let merged = MergedPattern::new(&state, &rate);
        assert_eq!(merged.pattern, Pattern::from_pairs(3, 3, &[(0, 0), (1, 0), (2, 0), (1, 1), (0, 2), (2, 2)]));
        let mut values = [0.0; 6];
        merged.combine(&[1.0, 2.0, 3.0, 4.0], &[10.0, 20.0, 30.0], 2.0, &mut values);
        assert_eq!(values, [21.0, 40.0, 2.0, 3.0, 4.0, 60.0]);
        merged.select((&state, &rate), &[1.0, 2.0, 3.0, 4.0], &[10.0, 20.0, 30.0], &[true, false, false], &mut values);
        assert_eq!(values, [10.0, 20.0, 0.0, 3.0, 4.0, 0.0]);
    }
}
