//! What a measured record shows of itself, before any model: sampling, noise, hum, drift, spikes, clipping, edges, repeats.
//!
//! Pure functions on slices of times (s, ascending) and values; values that are not finite are gaps.  Each file has one subject and
//! says where its method is from.  Times and values of a record are of equal length; where they are not, the shorter one counts.

mod clipping;
mod drift;
mod edge;
mod hum;
mod repeats;
mod sampling;
mod scatter;
mod spikes;
mod stuck;

pub(crate) use clipping::{Clipping, clipping, end_of_range};
pub(crate) use drift::{Drift, drift};
pub(crate) use edge::{edge, is_two_level};
pub(crate) use hum::{Line, MAINS, hum};
pub(crate) use repeats::repeats;
pub(crate) use sampling::{Gap, sampling};
pub(crate) use scatter::{Quiet, Scatter, quiet, scatter};
pub(crate) use spikes::{Spike, spikes};
pub(crate) use stuck::{Stuck, stuck};

/// What one channel of one shot shows.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Findings {
    /// Samples with a value.
    pub samples: usize,
    /// Smallest and largest value.
    pub range: (f64, f64),
    /// Noise by the differences of neighbours; none where there are too few.
    pub scatter: Option<Scatter>,
    /// Noise and level before the trigger; none where that part is too short.
    pub quiet: Option<Quiet>,
    /// Straight line through the part before the trigger.
    pub drift: Option<Drift>,
    /// Lines of the mains that the record is long enough for.
    pub hum: Vec<Line>,
    /// Isolated samples.
    pub spikes: Vec<Spike>,
    /// Values that stand at the largest or smallest one; none where there is nothing of the kind.
    pub clipping: Option<Clipping>,
    /// Equal values in a row far from their neighbours.
    pub stuck: Vec<Stuck>,
    /// Runs of missing values and of missing times.
    pub gaps: Vec<Gap>,
}

/// Looks at one channel of one shot whose trigger is at `trigger` (s).
///
/// None where no value is finite.
pub(crate) fn examine(times: &[f64], values: &[f64], trigger: f64) -> Option<Findings> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let samples = finite().count();
    if samples == 0 {
        return None;
    }
    let range = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let noise = scatter(times, values);
    let stuck = stuck(times, values, noise.as_ref(), range);
    let before = times.partition_point(|&t| t < trigger).min(values.len());
    Some(Findings {
        samples,
        range,
        scatter: noise,
        quiet: quiet(times, values, trigger),
        drift: drift(&times[..before.min(times.len())], &values[..before]),
        hum: hum(times, values),
        spikes: spikes(times, values),
        clipping: clipping(values, noise.as_ref()).and_then(|own| own.without(&stuck)),
        stuck,
        gaps: sampling::gaps(times, values),
    })
}

/// The middle of some numbers, of which it changes the order; none where there are none.
fn median(numbers: &mut [f64]) -> Option<f64> {
    if numbers.is_empty() {
        return None;
    }
    let middle = numbers.len() / 2;
    Some(*numbers.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    #[test]
    fn a_clean_record_shows_nothing_but_its_noise() {
        let mut draws = SplitMix(3);
        let times: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3 - 1.0).collect();
        // A valve opens: 5 V for 0.5 s with a lag of 20 ms.
        let signal = |t: f64| if t < 0.0 { 0.0 } else { 5.0 * (1.0 - (-t / 0.02).exp()) };
        let values: Vec<f64> = times.iter().map(|&t| signal(t) + 0.02 * draws.normal()).collect();
        let found = examine(&times, &values, 0.0).unwrap();
        assert_eq!(found.samples, 4000);
        assert!((found.scatter.unwrap().sigma / 0.02 - 1.0).abs() < 0.06, "{:?}", found.scatter);
        assert!((found.quiet.unwrap().sigma / 0.02 - 1.0).abs() < 0.07, "{:?}", found.quiet);
        assert!(found.drift.is_some_and(|drift| !drift.stands_out()), "{:?}", found.drift);
        assert!(found.hum.len() > 4 && found.hum.iter().all(|line| !line.stands_out), "{:?}", found.hum);
        assert!(
            found.spikes.is_empty() && found.clipping.is_none() && found.stuck.is_empty() && found.gaps.is_empty(),
            "{found:?}"
        );
        assert_eq!(examine(&times, &vec![f64::NAN; 4000], 0.0), None);
    }

    #[test]
    fn records_of_no_samples_end_in_nothing() {
        for (times, values) in
            [(&[][..], &[][..]), (&[0.0][..], &[1.0][..]), (&[0.0, 1.0, 2.0][..], &[1.0, 1.0, 1.0][..])]
        {
            let found = examine(times, values, 0.0);
            assert_eq!(found.is_none(), values.is_empty());
            assert!(found.is_none_or(|own| own.scatter.is_none() && own.hum.is_empty() && own.spikes.is_empty()));
        }
    }
}
