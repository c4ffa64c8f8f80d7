//! How the channels answer to a course at an equation.
//!
//! A course is a polygon over the time of each shot.  How the channels change per unit of each of its corners comes from sensitivities, as
//! for terms ([`crate::evidence::location`]): from then on what any course would do is a linear combination, and takes no run.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::Fault;
use crate::Setup;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::location::{ANY, TOGETHER, of_one_shot, signatures};
use crate::evidence::projection::{Projection, Score};
use crate::fit::{Fit, Jacobian};
use crate::machine::span::Span;
use crate::problem::Weighing;
use crate::terms::dictionary::Term;
use crate::variant::{Insert, Workshop};

/// Corners of two equations that differ by less, but for a factor, are the same.
const SAME: f64 = 1e-3;
/// Weight of the squared corners of a free course, by what the record says of them.
const FREE: f64 = 1e-6;

/// Corners of a course in one shot, and what each does to the residuals of that shot.
pub(crate) struct Corners {
    /// The shot.
    pub shot: usize,
    /// Times of the corners (s).
    pub times: Vec<f64>,
    /// The fit seen on this shot, which has derivatives.
    pub fit: Fit,
    /// Change of the residuals by unit of each corner.
    pub columns: DMatrix<f64>,
}

/// The corners at the equation of a term, shot by shot; `count` of a shot with so many samples.  Shots in which a corner cannot be run are
/// left out.
///
/// # Errors
/// A model that cannot be translated or run.
pub(crate) fn corners(
    setup: &Setup,
    workshop: &Workshop<'_>,
    (hypothesis, fit): (&Hypothesis, &Fit),
    term: &Term,
    (weighing, count): (&Weighing, &dyn Fn(usize) -> usize),
) -> Result<Vec<Corners>, Fault> {
    let inserts: Vec<Insert> = hypothesis
        .inserts
        .iter()
        .map(|candidate| Insert { candidate: candidate.clone(), values: Vec::new() })
        .collect();
    let problem = hypothesis.problem(setup)?;
    let mut all = Vec::new();
    for &shot in &weighing.shots {
        let (own, weighing) = of_one_shot(&problem, fit, weighing, shot);
        if own.jacobian.is_none() {
            continue;
        }
        let span = &setup.data.shots[shot].span;
        let count = count(setup.data.shots[shot].times.len()).max(2);
        let width = (span.stop - span.start) / (count - 1) as f64;
        let times: Vec<f64> = (0..count).map(|k| span.start + k as f64 * width).collect();
        let corner = |time: &f64| Term {
            shape: format!("noEvent(max(0, 1 - abs(time - ({time:e}))/({width:e})))"),
            ..term.clone()
        };
        let terms: Vec<Term> = times.iter().map(corner).collect();
        let mut columns = Vec::with_capacity(count);
        for some in terms.chunks(TOGETHER) {
            columns.extend(signatures(setup, workshop, hypothesis, &inserts, some, (&own.xi, &own.runs), &weighing)?);
        }
        let columns: Option<Vec<DVector<f64>>> = columns.into_iter().collect();
        if let Some(columns) = columns {
            all.push(Corners { shot, times, fit: own, columns: DMatrix::from_columns(&columns) });
        }
    }
    Ok(all)
}

impl Corners {
    /// By what the corners of another equation in the same shot are larger, if they do the same but for that.
    pub(crate) fn factor_of(&self, other: &Self) -> Option<f64> {
        if self.columns.shape() != other.columns.shape() {
            return None;
        }
        let factor = self.columns.dot(&other.columns) / self.columns.norm_squared();
        let off = (&other.columns - factor * &self.columns).norm();
        (factor != 0.0 && off < SAME * other.columns.norm()).then_some(factor)
    }

    /// The drop of the cost that any course would bring at most, and what may be off with it.
    pub(crate) fn gain(&self) -> Option<f64> {
        let projection = Projection::new(&self.fit)?;
        let seen = projection.seen(&self.columns);
        let inner = self.columns.tr_mul(&self.columns) - seen.tr_mul(&projection.followed(&seen));
        let along = projection.along(&self.columns, &seen);
        let ridge = FREE * (0..inner.nrows()).map(|k| inner[(k, k)]).sum::<f64>() / inner.nrows() as f64;
        let factor = Cholesky::new(inner + DMatrix::from_diagonal_element(along.len(), along.len(), ridge))?;
        Some(along.dot(&factor.solve(&along))).filter(|gain| gain.is_finite())
    }
}

/// What a course at an equation would explain, from products of its corners.
pub(crate) struct Response {
    shots: Vec<OfShot>,
}

struct OfShot {
    shot: usize,
    times: Vec<f64>,
    /// `S'S`, `J'S` and `S'r` of the corners `S`, the nuisances `J` and the residuals `r`.
    square: DMatrix<f64>,
    seen: DMatrix<f64>,
    plain: DVector<f64>,
}

impl Response {
    /// Of the corners of all shots of a fit; none where a shot is missing.
    pub(crate) fn new(corners: &[Corners], weighing: &Weighing) -> Option<Self> {
        let of = |own: &Corners| {
            let Jacobian { matrix, .. } = own.fit.jacobian.as_ref()?;
            Some(OfShot {
                shot: own.shot,
                times: own.times.clone(),
                square: own.columns.tr_mul(&own.columns),
                seen: matrix.tr_mul(&own.columns),
                plain: own.columns.tr_mul(&own.fit.residuals),
            })
        };
        let shots: Vec<OfShot> = corners.iter().map(of).collect::<Option<_>>()?;
        (shots.len() == weighing.shots.len()).then_some(Self { shots })
    }

    /// Distance of the corners of the shot where they are farthest apart (s).
    pub(crate) fn resolution(&self) -> f64 {
        let width = |own: &OfShot| own.times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        self.shots.iter().map(width).fold(0.0, f64::max)
    }

    /// Scores a course, given by shot on the output points of its run.
    pub(crate) fn score<'a>(
        &self,
        projection: &Projection<'_>,
        of: &dyn Fn(usize) -> Option<(&'a Span, Vec<f64>)>,
    ) -> Option<Score> {
        let (mut square, mut plain) = (0.0, 0.0);
        let mut seen: Option<DVector<f64>> = None;
        for own in &self.shots {
            let (span, course) = of(own.shot)?;
            let values = DVector::from_iterator(own.times.len(), own.times.iter().map(|&t| span.at(&course, t).0));
            square += values.dot(&(&own.square * &values));
            plain -= own.plain.dot(&values);
            let by = &own.seen * &values;
            seen = Some(seen.map_or_else(|| by.clone(), |seen| seen + &by));
        }
        let seen = seen?;
        (square.is_finite() && plain.is_finite()).then(|| projection.score_of((square, &seen, plain), ANY))
    }
}
