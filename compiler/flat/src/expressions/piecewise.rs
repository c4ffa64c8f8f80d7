//! Conditions and quotients of loop counters that are simple on parts of the loop: where to cut it.
//!
//! `if k > 1` is true or false for all values of `k` but for one boundary, `div(k, 2)` is affine on the even and on the odd values.
//! Where the values at hand lie on both sides, the failure [`Fail::Split`] says where to cut them, and the equation is lowered
//! once for each part.  Conditions that compare anything but affine functions of one counter are left to running
//! through the loop.

use hyd_symbolic::Relation;
use hyd_syntax::tree::BinaryOp;

use crate::state::context::{Context, Fail};
use crate::state::index::{Affine, Cut};

pub(crate) fn relation(op: BinaryOp) -> Option<Relation> {
    match op {
        BinaryOp::Equal => Some(Relation::Equal),
        BinaryOp::NotEqual => Some(Relation::NotEqual),
        BinaryOp::Less => Some(Relation::Less),
        BinaryOp::LessEqual => Some(Relation::LessEqual),
        BinaryOp::Greater => Some(Relation::Greater),
        BinaryOp::GreaterEqual => Some(Relation::GreaterEqual),
        _ => None,
    }
}

fn holds(relation: Relation, difference: i128) -> bool {
    match relation {
        Relation::Equal => difference == 0,
        Relation::NotEqual => difference != 0,
        Relation::Less => difference < 0,
        Relation::LessEqual => difference <= 0,
        Relation::Greater => difference > 0,
        Relation::GreaterEqual => difference >= 0,
    }
}

/// Truth of `difference <relation> 0` where it is the same for all values of the counters, else where to cut them.
pub(crate) fn truth(relation: Relation, difference: &Affine, cx: &Context) -> Result<bool, Fail> {
    let [(counter, slope)] = difference.terms.as_slice() else {
        return difference.as_constant().map(|d| holds(relation, d.into())).ok_or(Fail::NeedsExpansion);
    };
    // Twice as wide as the numbers of the text: no sum or product below leaves the range.
    let (constant, slope) = (i128::from(difference.constant), i128::from(*slope));
    let count = cx.counts[counter.0 as usize] as i128;
    let at = |k: i128| constant + slope * k;
    let first = holds(relation, at(0));
    // The only position at which the difference is zero, and the first one behind its change of sign.
    let zero = (constant % slope == 0).then(|| -constant / slope);
    let beyond = (-constant * slope.signum()).div_euclid(slope.abs()) + 1;
    let change = match (relation, zero) {
        (Relation::Equal | Relation::NotEqual, None) => None,
        (Relation::Equal | Relation::NotEqual, Some(0)) => Some(1),
        (Relation::Equal | Relation::NotEqual, Some(k)) => Some(k),
        (_, Some(k)) => [k, k + 1].into_iter().find(|&k| k > 0 && holds(relation, at(k)) != first),
        (_, None) => Some(beyond),
    };
    match change.filter(|&k| 0 < k && k < count) {
        Some(k) => Err(cx.cut(*counter, Cut::At(k as usize))),
        None => Ok(first),
    }
}

pub(crate) fn common_divisor(a: i64, b: i64) -> i64 {
    if b == 0 { a.abs() } else { common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::index::CounterId;

    /// Every condition, cut where it says, is true for exactly the values for which it holds.
    #[test]
    fn cuts_are_where_the_truth_changes() {
        let relations = [
            Relation::Equal,
            Relation::NotEqual,
            Relation::Less,
            Relation::LessEqual,
            Relation::Greater,
            Relation::GreaterEqual,
        ];
        let near =
            (-7..8).flat_map(|c| [-3, -2, -1, 1, 2, 3].into_iter().flat_map(move |s| (2..7).map(move |n| (c, s, n))));
        let far = [i64::MIN, i64::MIN + 1, -1, 0, 5, i64::MAX];
        let far = far.iter().flat_map(|&c| far.iter().filter(|&&s| s != 0).map(move |&s| (c, s, 4)));
        for (constant, slope, count) in near.chain(far) {
            let difference = Affine { constant, terms: vec![(CounterId(0), slope)] };
            let mut cx = Context::new(hyd_instance::Scope { inst: hyd_instance::InstId(0), frame: 0 });
            cx.counts = vec![count];
            cx.cuts_left = 1;
            for relation in relations {
                let truths: Vec<bool> =
                    (0..count as i128).map(|k| holds(relation, i128::from(constant) + i128::from(slope) * k)).collect();
                match truth(relation, &difference, &cx) {
                    Ok(all) => assert!(truths.iter().all(|&t| t == all), "{relation:?} {constant} {slope} {count}"),
                    Err(Fail::Split(_, Cut::At(k))) => {
                        assert!(truths[..k].iter().all(|&t| t == truths[0]), "{relation:?} {constant} {slope} {count}");
                        assert!(
                            truths[k] != truths[0] || relation == Relation::NotEqual || relation == Relation::Equal
                        );
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }
}
