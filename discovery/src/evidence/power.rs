//! What these shots could have shown: how large an effect must be to be seen, and which effects look alike.
//!
//! The drop of the cost to expect from an effect of typical size is the squared length of its signature after the nuisances have
//! taken their share, `d'Pd`.  An effect is taken for seen with the probability that a normal variable stays below
//! `sqrt(d'Pd) - 5`, since a drop of 25 is asked for; two effects are told apart where `d'Pd (1 - cos^2) > 45`, with the
//! cosine of their projected signatures.

use std::sync::Arc;

use hyd_system::math::exp;
use nalgebra::DVector;

use crate::evidence::projection::Projection;

/// The drop of the cost with which an effect is seen in 95 of 100 sets, and at which two are told apart.
pub(crate) const CLEAR: f64 = 45.0;
/// Root of the drop that a name needs.
const NEEDED: f64 = 5.0;
/// Pairs with a smaller cosine are not listed.
const ALIKE: f64 = 0.6;
/// Effects that drop the cost by less than this are seen by nobody and taken for nothing else.
const INVISIBLE: f64 = 1.0;

/// How well an effect can be seen.
#[derive(Clone, Debug)]
pub struct Power {
    /// Id of the effect.
    pub id: Arc<str>,
    /// The effect, with its place where it has several.
    pub effect: String,
    /// Typical size.
    pub typical: f64,
    /// Drop of the cost to expect at that size.
    pub cost_drop: f64,
    /// Share of the squared signature that the nuisances leave.
    pub left: f64,
}

impl Power {
    /// Probability that an effect of typical size is seen.
    pub fn chance(&self) -> f64 {
        normal_share(self.cost_drop.sqrt() - NEEDED)
    }

    /// Size that is seen in 95 of 100 sets, if the signature grows with the size.
    pub fn smallest(&self) -> f64 {
        self.typical * (CLEAR / self.cost_drop).sqrt()
    }
}

/// Two effects that look alike.
#[derive(Clone, Debug)]
pub struct Confusion {
    /// Their names.
    pub effects: (String, String),
    /// Cosine of their signatures after the nuisances have taken their share.
    pub cosine: f64,
    /// Drop of the cost by which the weaker one at typical size is told from the other.
    pub apart: f64,
}

/// Pairs that look alike, those that are hardest to tell apart first.
pub(crate) fn confusions(signatures: &[(Power, DVector<f64>)], projection: &Projection<'_>) -> Vec<Confusion> {
    let visible: Vec<&(Power, DVector<f64>)> =
        signatures.iter().filter(|(power, _)| power.cost_drop > INVISIBLE).collect();
    let mut found = Vec::new();
    for (k, (one, a)) in visible.iter().enumerate() {
        for (other, b) in &visible[k + 1..] {
            let cosine = projection.inner(a, b) / (one.cost_drop * other.cost_drop).sqrt();
            if cosine.abs() < ALIKE {
                continue;
            }
            let apart = one.cost_drop.min(other.cost_drop) * (1.0 - cosine * cosine).max(0.0);
            found.push(Confusion { effects: (one.effect.clone(), other.effect.clone()), cosine, apart });
        }
    }
    found.sort_by(|a, b| a.apart.total_cmp(&b.apart));
    found
}

/// Share of a normal distribution below `x` (Abramowitz, Stegun 26.2.17; error below 1e-7).
pub(crate) fn normal_share(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let poly =
        t * (0.319_381_530 + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let tail = exp(-0.5 * x * x) / (2.0 * std::f64::consts::PI).sqrt() * poly;
    if x >= 0.0 { 1.0 - tail } else { tail }
}

#[cfg(test)]
mod tests {
    use super::normal_share;

    #[test]
    fn shares_of_the_normal_distribution() {
        // Tabulated values (Abramowitz, Stegun, table 26.1).
        for (x, share) in [(0.0, 0.5), (1.0, 0.841_344_746), (-1.96, 0.024_997_895), (1.644_853_6, 0.95)] {
            assert!((normal_share(x) - share).abs() < 1e-7, "{x}");
        }
    }
}
