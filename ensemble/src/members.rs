//! The members of an ensemble: parameter values by number.
//!
//! Listed values are crossed, the first parameter changing slowest; for each combination there are as many draws as samples, and
//! the draws are the same for every combination (common random numbers make differences between combinations sharper).

use hyd_system::random::Xoshiro;

use crate::{Method, Variation};

/// Largest number of members.
const MOST: usize = 1_000_000_000;
/// Largest number of draws that are held in memory.
const MOST_DRAWS: usize = 100_000_000;

/// Parameter values of all members.
#[derive(Clone, PartialEq, Debug)]
pub struct Members {
    variations: Vec<Variation>,
    samples: usize,
    count: usize,
    /// `samples` values for each drawn variation.
    draws: Vec<Vec<f64>>,
}

impl Members {
    /// `None` if there would be too many.
    pub(crate) fn new(variations: Vec<Variation>, samples: usize, method: Method, seed: u64) -> Option<Self> {
        let count = count(&variations, samples)?;
        let draws = variations.iter().enumerate().map(|(stream, variation)| match variation.is_drawn() {
            true => draw(variation, samples, method, Xoshiro::new(seed, stream as u64)),
            false => Vec::new(),
        });
        let draws = draws.collect();
        Some(Self { variations, samples, count, draws })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Values of the varied parameters of member `k`, in the order of the plan.
    pub fn values(&self, k: usize) -> Vec<f64> {
        let (sample, mut rest) = (k % self.samples, k / self.samples);
        let mut values = vec![0.0; self.variations.len()];
        for j in (0..self.variations.len()).rev() {
            values[j] = match &self.variations[j] {
                Variation::Values(listed) => {
                    let value = listed[rest % listed.len()];
                    rest /= listed.len();
                    value
                }
                _ => self.draws[j][sample],
            };
        }
        values
    }
}

/// How many members there are; none if there would be too many.
pub(crate) fn count(variations: &[Variation], samples: usize) -> Option<usize> {
    let listed = variations.iter().filter_map(Variation::listed);
    let count = listed.clone().try_fold(samples, usize::checked_mul)?;
    let drawn = variations.len() - listed.count();
    let possible = count != 0 && count <= MOST && samples.checked_mul(drawn.max(1))? <= MOST_DRAWS;
    possible.then_some(count)
}

fn draw(variation: &Variation, samples: usize, method: Method, mut random: Xoshiro) -> Vec<f64> {
    match method {
        Method::Random => (0..samples).map(|_| variation.quantile(random.uniform())).collect(),
        Method::Lhs => {
            let order = random.permutation(samples);
            let n = samples as f64;
            order.into_iter().map(|k| variation.quantile((f64::from(k) + random.uniform()) / n)).collect()
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hyd_system::ValueKind;

    use super::*;

    fn members(texts: &[&str], samples: usize, method: Method) -> Members {
        let variations =
            texts.iter().map(|text| Variation::parse(text).unwrap().for_kind(&ValueKind::Real).unwrap()).collect();
        Members::new(variations, samples, method, 42).unwrap()
    }

    #[test]
    fn a_grid_is_crossed_with_the_first_slowest() {
        let grid = members(&["1:2:2", "10,20,30"], 1, Method::Lhs);
        let all: Vec<Vec<f64>> = (0..grid.count()).map(|k| grid.values(k)).collect();
        let expected: [[f64; 2]; 6] = [[1., 10.], [1., 20.], [1., 30.], [2., 10.], [2., 20.], [2., 30.]];
        assert_eq!(all, expected);
    }

    #[test]
    fn a_latin_hypercube_has_one_value_in_each_interval() {
        let cube = members(&["0:1", "uniform(0, 1)", "5,6"], 50, Method::Lhs);
        assert_eq!(cube.count(), 100);
        for j in 0..2 {
            let mut seen: Vec<usize> = (0..50).map(|k| (cube.values(k)[j] * 50.0) as usize).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..50).collect::<Vec<_>>());
        }
        // The same draws for both listed values.
        assert_eq!(cube.values(7)[0], cube.values(57)[0]);
        assert_ne!(cube.values(7)[2], cube.values(57)[2]);
    }

    #[test]
    fn another_parameter_changes_no_draw() {
        let one = members(&["0:1"], 10, Method::Random);
        let two = members(&["0:1", "0:1"], 10, Method::Random);
        assert!((0..10).all(|k| one.values(k)[0] == two.values(k)[0]));
        assert!(Members::new(vec![Variation::Uniform(0.0, 1.0)], 0, Method::Lhs, 0).is_none());
    }
}
