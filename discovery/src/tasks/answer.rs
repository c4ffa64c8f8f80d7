//! Answers to tasks as bytes, from which they come back to the bit.
//!
//! Numbers are little-endian, lists begin with their lengths.  Nothing is read beyond the end, whatever lengths say.

use nalgebra::{DMatrix, DVector};

use crate::evidence::hypothesis::Look;
use crate::evidence::projection::Score;
use crate::fit::schedule::{Attempt, Record};
use crate::fit::{Fit, Jacobian};

/// What another process can give.
pub(crate) trait Answer: Sized {
    /// Writes it behind what was written before.
    fn write(&self, to: &mut Writer);
    /// Reads it; none where the bytes hold something else.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// Bytes in the making.
#[derive(Default)]
pub(crate) struct Writer(pub(super) Vec<u8>);

/// Bytes that are left.
pub(crate) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (own, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(own)
    }

    /// A length of a list whose elements take at least so many bytes.
    fn length(&mut self, least: usize) -> Option<usize> {
        usize::read(self).filter(|&length| length.checked_mul(least).is_some_and(|all| all <= self.0.len()))
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = self.length(8)?;
        let bytes = self.bytes(8 * count)?;
        Some(bytes.as_chunks::<8>().0.iter().map(|own| f64::from_le_bytes(*own)).collect())
    }
}

impl Writer {
    fn numbers(&mut self, numbers: &[f64]) {
        numbers.len().write(self);
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }
}

impl Answer for f64 {
    fn write(&self, to: &mut Writer) {
        to.0.extend(self.to_le_bytes());
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(f64::from_le_bytes(*from.bytes(8)?.as_array()?))
    }
}

impl Answer for usize {
    fn write(&self, to: &mut Writer) {
        to.0.extend((*self as u64).to_le_bytes());
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        usize::try_from(u64::from_le_bytes(*from.bytes(8)?.as_array()?)).ok()
    }
}

impl Answer for bool {
    fn write(&self, to: &mut Writer) {
        to.0.push(u8::from(*self));
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        match from.bytes(1)? {
            [0] => Some(false),
            [1] => Some(true),
            _ => None,
        }
    }
}

impl Answer for String {
    fn write(&self, to: &mut Writer) {
        self.len().write(to);
        to.0.extend(self.as_bytes());
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let length = from.length(1)?;
        String::from_utf8(from.bytes(length)?.to_vec()).ok()
    }
}

impl<T: Answer> Answer for Option<T> {
    fn write(&self, to: &mut Writer) {
        self.is_some().write(to);
        self.iter().for_each(|own| own.write(to));
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        if bool::read(from)? { T::read(from).map(Some) } else { Some(None) }
    }
}

impl<A: Answer, B: Answer> Answer for (A, B) {
    fn write(&self, to: &mut Writer) {
        self.0.write(to);
        self.1.write(to);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some((A::read(from)?, B::read(from)?))
    }
}

/// Lists of what takes a byte or more.
impl<T: Answer> Answer for Vec<T> {
    fn write(&self, to: &mut Writer) {
        self.len().write(to);
        self.iter().for_each(|own| own.write(to));
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let length = from.length(1)?;
        (0..length).map(|_| T::read(from)).collect()
    }
}

/// Many numbers.
struct Numbers(Vec<f64>);

impl Answer for Numbers {
    fn write(&self, to: &mut Writer) {
        to.numbers(&self.0);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        from.numbers().map(Numbers)
    }
}

impl Answer for DVector<f64> {
    fn write(&self, to: &mut Writer) {
        to.numbers(self.as_slice());
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        from.numbers().map(DVector::from_vec)
    }
}

impl Answer for Jacobian {
    fn write(&self, to: &mut Writer) {
        // Without its rows it is nothing but the covariance, which tasks never leave of it.
        self.matrix.nrows().write(to);
        to.numbers(self.matrix.as_slice());
        self.unknowns.write(to);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let (rows, numbers, unknowns) = (usize::read(from)?, from.numbers()?, Vec::<usize>::read(from)?);
        let is_whole = rows.checked_mul(unknowns.len()) == Some(numbers.len());
        is_whole.then(|| Jacobian::new(DMatrix::from_vec(rows, unknowns.len(), numbers), unknowns))
    }
}

impl Answer for Fit {
    fn write(&self, to: &mut Writer) {
        let Fit { xi, runs, residuals, cost, misfit, converged, steps, jacobian, fresh, wall } = self;
        to.numbers(xi);
        runs.len().write(to);
        for run in runs {
            run.is_some().write(to);
            if let Some(channels) = run {
                channels.len().write(to);
                channels.iter().for_each(|channel| to.numbers(channel));
            }
        }
        residuals.write(to);
        ((*cost, *misfit), (*converged, *steps)).write(to);
        jacobian.write(to);
        fresh.write(to);
        wall.write(to);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let xi = from.numbers()?;
        let runs = Vec::<Option<Vec<Numbers>>>::read(from)?.into_iter();
        let runs = runs.map(|run| run.map(|channels| channels.into_iter().map(|own| own.0).collect())).collect();
        let residuals = DVector::read(from)?;
        let ((cost, misfit), (converged, steps)) = Answer::read(from)?;
        let (jacobian, fresh, wall) = (Option::read(from)?, bool::read(from)?, Option::read(from)?);
        Some(Fit { xi, runs, residuals, cost, misfit, converged, steps, jacobian, fresh, wall })
    }
}

impl Answer for Record {
    fn write(&self, to: &mut Writer) {
        self.attempts.len().write(to);
        for Attempt { start, misfit, cost, steps, converged } in &self.attempts {
            start.write(to);
            ((*misfit, *cost), (*steps, *converged)).write(to);
        }
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let count = from.length(1)?;
        let attempt = |_| {
            let (start, ((misfit, cost), (steps, converged))) = Answer::read(from)?;
            Some(Attempt { start, misfit, cost, steps, converged })
        };
        Some(Record { attempts: (0..count).map(attempt).collect::<Option<_>>()? })
    }
}

impl Answer for Score {
    fn write(&self, to: &mut Writer) {
        let Score { power, amplitude, gain, opposite, left, alone } = *self;
        [power, amplitude, gain, opposite, left, alone].iter().for_each(|own| own.write(to));
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut next = || f64::read(from);
        let (power, amplitude, gain) = (next()?, next()?, next()?);
        Some(Score { power, amplitude, gain, opposite: next()?, left: next()?, alone: next()? })
    }
}

impl Answer for Look {
    fn write(&self, to: &mut Writer) {
        let Look { score, size, start, alone, typical, probed } = self;
        score.write(to);
        size.write(to);
        to.numbers(start);
        alone.write(to);
        typical.is_some().write(to);
        if let Some((size, score, signature)) = typical {
            size.write(to);
            score.write(to);
            signature.write(to);
        }
        probed.write(to);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let (score, size, start, alone) = (Score::read(from)?, f64::read(from)?, from.numbers()?, f64::read(from)?);
        let typical = match bool::read(from)? {
            true => Some((f64::read(from)?, Score::read(from)?, DVector::read(from)?)),
            false => None,
        };
        Some(Look { score, size, start, alone, typical, probed: Answer::read(from)? })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tasks::Task;

    fn fit() -> Fit {
        let matrix = DMatrix::from_fn(7, 3, |i, k| (i as f64 - 3.0) / (k as f64 + 3.0));
        Fit {
            xi: vec![0.1, -0.0, f64::MIN_POSITIVE / 8.0],
            runs: vec![None, Some(vec![vec![1.0, f64::NAN], Vec::new()])],
            residuals: DVector::from_vec(vec![1e300, -3.5]),
            cost: 1.0 / 3.0,
            misfit: f64::INFINITY,
            converged: true,
            steps: 17,
            jacobian: Some(Jacobian::new(matrix, vec![0, 2, 5])),
            fresh: false,
            wall: None,
        }
    }

    fn bytes(answer: &impl Answer) -> Vec<u8> {
        let mut writer = Writer::default();
        answer.write(&mut writer);
        writer.0
    }

    #[test]
    fn fits_come_back_to_the_bit() {
        let stopped = Fit { wall: Some("logarithm of -1".to_string()), ..fit() };
        let own = bytes(&(Some(stopped), None::<Fit>));
        let mut reader = Reader::new(&own);
        let again = <(Option<Fit>, Option<Fit>)>::read(&mut reader).unwrap();
        assert!(reader.0.is_empty());
        // Bytes tell more than `==`: signs of zeros, and numbers that are none.
        assert_eq!(bytes(&again), own);
        let score = Score { power: 1.0, amplitude: -2.0, gain: 3.0, opposite: 4.0, left: 0.5, alone: 6.0 };
        let typical = Some((2.0, score, DVector::from_vec(vec![1.0, 2.0])));
        let start = vec![0.5];
        let own = bytes(&Look { score, size: 7.0, start, alone: 8.0, typical, probed: Some((9.0, vec![1.0])) });
        assert_eq!(bytes(&Look::read(&mut Reader::new(&own)).unwrap()), own);
        let mut record = Record::default();
        record.note("growing horizon", &fit(), 3.0);
        assert_eq!(bytes(&Record::read(&mut Reader::new(&bytes(&record))).unwrap()), bytes(&record));
    }

    #[test]
    fn names_of_tasks_hold_all_that_decides_their_answers() {
        let matrix = |last: f64| DMatrix::from_row_slice(1, 2, &[1.0, last]);
        let changed = [
            fit(),
            Fit { xi: vec![0.1, 0.0, f64::MIN_POSITIVE / 8.0], ..fit() },
            Fit { cost: 0.5, ..fit() },
            Fit { fresh: true, ..fit() },
            Fit { jacobian: None, ..fit() },
            Fit { jacobian: Some(Jacobian::new(matrix(2.0), vec![0, 2])), ..fit() },
            Fit { jacobian: Some(Jacobian::new(matrix(3.0), vec![0, 2])), ..fit() },
            Fit { jacobian: Some(Jacobian::new(matrix(3.0), vec![0, 1])), ..fit() },
        ];
        let mut names: Vec<String> = changed.iter().map(|own| Task::new("fit".to_string()).with(own).name()).collect();
        names.push(Task::new("fit".to_string()).name());
        names.push(Task::new("look".to_string()).with(&fit()).name());
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        assert_eq!(Task::new("fit".to_string()).with(&fit()).name(), Task::new("fit".to_string()).with(&fit()).name());
    }

    #[test]
    fn no_bytes_are_read_that_are_not_there() {
        let own = bytes(&fit());
        for end in 0..own.len() {
            assert!(Fit::read(&mut Reader::new(&own[..end])).is_none(), "{end}");
        }
        // A length that no memory has.
        let mut large = own;
        large[..8].fill(0xff);
        assert!(Fit::read(&mut Reader::new(&large)).is_none());
    }
}
