//! What a shot would say: expected differences of the cost once everything that may be off has followed.
//!
//! All is linear around the fits.  What the shots that were made know of the unknowns of all shots is `M = J'J + I`, what belongs to
//! those shots alone eliminated.  A new shot with the derivatives `S` by these and `Z` by its own unknowns adds the information
//! `S'WS` with `W = (I + ZZ')^-1`, and where its record differs from the model's by `d`, the cost of the best fit grows by
//! `d'Wd - g'(M + S'WS)^-1 g` with `g = S'Wd`: the criterion by which Box and Hill (1967) and Atkinson and Fedorov (1975) choose
//! experiments that tell rival models apart, with a prior.  Shots add up.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::fit::{Jacobian, normal};
use crate::unknowns::Unknown;

/// What the shots that were made know of the unknowns that hold for all shots.
pub(crate) struct Known {
    /// Names and effects of these unknowns, by their positions in the problem of the fit.
    pub common: Vec<usize>,
    /// `M`.
    pub information: DMatrix<f64>,
    jacobian: DMatrix<f64>,
    /// Columns of the Jacobian of what is common, and of what is not.
    columns: (Vec<usize>, Vec<usize>),
    /// `J'J + I` of what is not common, factored, and its coupling to what is.
    own: Option<(Cholesky<f64, Dyn>, DMatrix<f64>)>,
}

impl Known {
    /// Of a Jacobian by some unknowns; none where it is not finite.
    pub(crate) fn of(jacobian: &Jacobian, unknowns: &[Unknown]) -> Option<Self> {
        let all: Vec<usize> = (0..jacobian.unknowns.len()).collect();
        let is_common = |column: &usize| unknowns[jacobian.unknowns[*column]].shot.is_none();
        let (common, own): (Vec<usize>, Vec<usize>) = all.into_iter().partition(is_common);
        let whole = normal(&jacobian.matrix);
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, k| whole[(rows[i], columns[k])])
        };
        let mut information = part(&common, &common);
        let mut eliminated = None;
        if !own.is_empty() {
            let factor = Cholesky::new(part(&own, &own))?;
            let coupling = part(&own, &common);
            information -= coupling.transpose() * factor.solve(&coupling);
            eliminated = Some((factor, coupling));
        }
        Some(Self {
            common: common.iter().map(|&column| jacobian.unknowns[column]).collect(),
            information,
            jacobian: jacobian.matrix.clone(),
            columns: (common, own),
            own: eliminated,
        })
    }

    /// `d'Wd` and `J'Wd` of a change of the residuals of the shots that were made.
    pub(crate) fn change(&self, change: &DVector<f64>) -> Change {
        let pull = self.jacobian.tr_mul(change);
        let of = |columns: &[usize]| DVector::from_iterator(columns.len(), columns.iter().map(|&column| pull[column]));
        let (mut square, mut common) = (change.norm_squared(), of(&self.columns.0));
        if let Some((factor, coupling)) = &self.own {
            let own = of(&self.columns.1);
            let followed = factor.solve(&own);
            square -= own.dot(&followed);
            common -= coupling.tr_mul(&followed);
        }
        (square, common)
    }
}

/// What shots that are planned say of one model: sums over them.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    /// `S'WS`.
    pub information: DMatrix<f64>,
    /// By each rival `d'Wd` and `S'Wd`, where the record is the rival's.
    pub against: Vec<Change>,
}

/// The square of a change, and its pull on what is common.
pub(crate) type Change = (f64, DVector<f64>);

impl Share {
    /// Nothing yet, of so many unknowns and rivals.
    pub(crate) fn none(unknowns: usize, rivals: usize) -> Self {
        Self { information: DMatrix::zeros(unknowns, unknowns), against: vec![(0.0, DVector::zeros(unknowns)); rivals] }
    }

    /// Of one shot: derivatives by what is common and by what belongs to it, and its changes.
    pub(crate) fn of(common: &DMatrix<f64>, own: &DMatrix<f64>, changes: &[DVector<f64>]) -> Option<Self> {
        let factor = Cholesky::new(normal(own))?;
        let coupling = own.tr_mul(common);
        let information = common.tr_mul(common) - coupling.transpose() * factor.solve(&coupling);
        let against = changes.iter().map(|change| {
            let follows = own.tr_mul(change);
            let solved = factor.solve(&follows);
            (change.norm_squared() - follows.dot(&solved), common.tr_mul(change) - coupling.tr_mul(&solved))
        });
        Some(Self { against: against.collect(), information })
    }

    /// Both together.
    pub(crate) fn plus(&self, other: &Share) -> Share {
        let sum = |(a, b): (&Change, &Change)| (a.0 + b.0, &a.1 + &b.1);
        Share {
            information: &self.information + &other.information,
            against: self.against.iter().zip(&other.against).map(sum).collect(),
        }
    }

    /// By how much the cost of the best fit grows where the record is a rival's, and where the unknowns of all shots go.
    pub(crate) fn growth(&self, known: &DMatrix<f64>, rival: usize) -> Option<(f64, DVector<f64>)> {
        let (square, pull) = &self.against[rival];
        let moved = -Cholesky::new(known + &self.information)?.solve(pull);
        Some(((square + pull.dot(&moved)).max(0.0), moved))
    }

    /// By which factor these shots narrow the interval of an unknown of all shots.
    pub(crate) fn narrowing(&self, known: &DMatrix<f64>, unknown: usize) -> Option<f64> {
        let variance = |information: DMatrix<f64>| {
            let mut unit = DVector::zeros(information.nrows());
            unit[unknown] = 1.0;
            Some(Cholesky::new(information)?.solve(&unit)[unknown])
        };
        let (before, after) = (variance(known.clone())?, variance(known + &self.information)?);
        Some((after / before).sqrt())
    }
}

/// The change of a shot's residuals that is left when everything has followed: what tells a rival from the model, sample by sample.
pub(crate) fn left(
    common: &DMatrix<f64>,
    own: &DMatrix<f64>,
    change: &DVector<f64>,
    moved: &DVector<f64>,
) -> Option<DVector<f64>> {
    let followed = change + common * moved;
    let factor = Cholesky::new(normal(own))?;
    let solved = factor.solve(&own.tr_mul(&followed));
    Some(followed - own * solved)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Known, Share, left};
    use crate::fit::Jacobian;
    use crate::unknowns::{Meaning, Unknown};

    /// Two shots made and one planned, each with an unknown of its own and two that hold for all: the growth of the cost is that of the
    /// least-squares problem of all rows together.
    #[test]
    fn what_is_eliminated_shot_by_shot_is_the_whole_problem() {
        let wave = |seed: f64, rows: usize, columns: usize| {
            DMatrix::from_fn(rows, columns, |i, k| (seed + 1.3 * i as f64 + 2.1 * k as f64).sin())
        };
        let (made, planned) = (wave(0.2, 12, 4), wave(0.9, 7, 3));
        let change = DVector::from_fn(7, |k, _| (0.5 * k as f64).cos());
        let before = DVector::from_fn(12, |k, _| 0.3 * (0.7 * k as f64).cos());
        // Columns: common, own of the first shot, common, own of the second.
        let mut jacobian = made.clone();
        (0..6).for_each(|row| jacobian[(row, 3)] = 0.0);
        (6..12).for_each(|row| jacobian[(row, 1)] = 0.0);
        let shots = [None, Some(0), None, Some(1)];
        let unknown = |shot| Unknown::new(String::new(), Meaning::Clock { sigma: 1.0 }, shot, None);
        let unknowns: Vec<Unknown> = shots.into_iter().map(unknown).collect();
        let known = Known::of(&Jacobian::new(jacobian.clone(), vec![0, 1, 2, 3]), &unknowns).expect("finite");
        let (common, own) = (planned.columns(0, 2).into_owned(), planned.columns(2, 1).into_owned());
        let mut share = Share::of(&common, &own, std::slice::from_ref(&change)).expect("finite");
        let (square, pull) = known.change(&before);
        share.against[0].0 += square;
        share.against[0].1 += pull;
        let (growth, moved) = share.growth(&known.information, 0).expect("finite");

        let mut all = DMatrix::zeros(19, 5);
        all.view_mut((0, 0), (12, 4)).copy_from(&jacobian);
        all.view_mut((12, 0), (7, 1)).copy_from(&common.column(0));
        all.view_mut((12, 2), (7, 1)).copy_from(&common.column(1));
        all.view_mut((12, 4), (7, 1)).copy_from(&own);
        let changes = DVector::from_iterator(19, before.iter().chain(change.iter()).copied());
        let normal = all.tr_mul(&all) + DMatrix::identity(5, 5);
        let solved = normal.clone().lu().solve(&all.tr_mul(&changes)).expect("regular");
        let whole = changes.norm_squared() - all.tr_mul(&changes).dot(&solved);
        assert!((growth - whole).abs() < 1e-10 * whole, "{growth} {whole}");
        assert!((moved[0] + solved[0]).abs() < 1e-10 && (moved[1] + solved[2]).abs() < 1e-10);
        let rest = left(&common, &own, &change, &moved).expect("finite");
        let expected = (&changes - &all * &solved).rows(12, 7).into_owned();
        assert!((rest - expected).amax() < 1e-10);
        // The interval of the second common unknown.
        let variance = |matrix: DMatrix<f64>| matrix.try_inverse().expect("regular");
        let alone = variance(jacobian.tr_mul(&jacobian) + DMatrix::identity(4, 4))[(2, 2)];
        let both = variance(normal)[(2, 2)];
        let narrowing = share.narrowing(&known.information, 1).expect("finite");
        assert!((narrowing - (both / alone).sqrt()).abs() < 1e-10);
    }
}
