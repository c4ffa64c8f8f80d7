//! Samples that belong to nothing: far from the model while their neighbours are not (Hampel 1974: identifier by the median of
//! absolute deviations, here about the model).

/// Samples to either side whose median absolute residual is the scale.
const WINDOW: usize = 25;
/// A spike is this many scales from the model, and what lies farther than the second belongs to it.
const FAR: (f64, f64) = (7.0, 3.5);
/// Samples in a row that may be one spike.
const LONGEST: usize = 2;
/// Of more samples than this share none is a spike.
const MOST: f64 = 0.02;
/// Median of the absolute value of a standard normal variable.
const MEDIAN: f64 = 0.674_49;

/// Positions of spikes among the residuals of a record, in standard deviations of the noise.
pub(super) fn find(residuals: &[f64], weights: &[f64]) -> Vec<usize> {
    let used: Vec<usize> = (0..residuals.len()).filter(|&k| weights[k] > 0.0).collect();
    if used.len() < 2 * WINDOW || used.iter().all(|&k| residuals[k].abs() <= FAR.0) {
        return Vec::new();
    }
    let scale = |place: usize| {
        let from = place.saturating_sub(WINDOW).min(used.len() - 2 * WINDOW);
        let mut around: Vec<f64> = used[from..from + 2 * WINDOW].iter().map(|&k| residuals[k].abs()).collect();
        let middle = around.len() / 2;
        let (_, median, _) = around.select_nth_unstable_by(middle, f64::total_cmp);
        (*median / MEDIAN).max(1.0)
    };
    let size = |place: usize| residuals[used[place]].abs();
    let mut spikes = Vec::new();
    let mut place = 0;
    while place < used.len() {
        if size(place) <= FAR.1 {
            place += 1;
            continue;
        }
        let scale = scale(place);
        let end = (place..used.len()).find(|&k| size(k) <= FAR.1 * scale).unwrap_or(used.len());
        let largest = (place..end).map(size).fold(0.0, f64::max);
        if end - place <= LONGEST && largest > FAR.0 * scale {
            spikes.extend(used[place..end].iter().copied());
        }
        place = end.max(place + 1);
    }
    if spikes.len() as f64 > MOST * used.len() as f64 { Vec::new() } else { spikes }
}

#[cfg(test)]
mod tests {
    use super::find;
    use hyd_system::random::SplitMix;

    #[test]
    fn lone_samples_are_spikes_and_what_lasts_is_not() {
        let mut draws = SplitMix(9);
        let mut values: Vec<f64> = (0..600).map(|_| draws.normal()).collect();
        (values[0], values[1], values[77], values[400]) = (30.0, -25.0, -12.0, 9.0);
        // A smooth misfit of the model is not a spike, however large.
        for k in 0..40 {
            values[200 + k] += 40.0 * (k as f64 / 39.0 * std::f64::consts::PI).sin();
        }
        let weights = vec![1.0; 600];
        assert_eq!(find(&values, &weights), [0, 1, 77, 400]);
        let quiet: Vec<f64> = (0..2000).map(|_| draws.normal()).collect();
        assert!(find(&quiet, &vec![1.0; 2000]).is_empty());
    }
}
