//! Sines and cosines of several angles at once.
//!
//! A mechanism asks for both functions of all its angles in every evaluation.  Four angles take little longer than one:
//! reduction by multiples of a quarter turn and both polynomials are those of FDLIBM (Sun Microsystems 1993; `e_rem_pio2.c`,
//! `k_sin.c`, `k_cos.c`), operation by operation, so that every value has the bits of [`Function::apply`].  Groups with an
//! angle that needs the second round of the reduction are computed again with both, which angles of some thousand turns do;
//! what needs more, or lies where the library's tables of cases decide, is left to the library.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

use crate::lanes::{LANES, Lanes, Masks, ROUNDING, bits, choose, each, masks, wide};
use crate::math::Function;

/// Four angles in rad and what belongs to them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Angles {
    /// Given.
    pub angles: Lanes,
    /// Their sines.
    pub sines: Lanes,
    /// Their cosines.
    pub cosines: Lanes,
}

/// The first 33 bits of pi/2 and the rest.
const QUARTER: [f64; 2] = [f64::from_bits(0x3FF9_21FB_5440_0000), f64::from_bits(0x3DD0_B461_1A62_6331)];
/// The next 33 bits, and the rest.
const FINER: [f64; 2] = [f64::from_bits(0x3DD0_B461_1A60_0000), f64::from_bits(0x3BA3_198A_2E03_7073)];
/// Angles below it are not reduced: the least with an upper half above that of pi/4.
const INNER: f64 = f64::from_bits(0x3FE9_21FC_0000_0000);
/// Smaller angles are their own sines.
const TINY: f64 = 1.0 / 67_108_864.0;
/// Below it the library takes one round in any case: the least with an upper half above that of 9*pi/4.
const NEAR: f64 = f64::from_bits(0x401C_463C_0000_0000);
/// Two rounds are for angles below 2^20*pi/2; a little less.
const OUTER: f64 = 1.6e6;
/// Bits that may cancel in the first round, and in the second.
const CANCELLED: [u64; 2] = [16, 49];
/// Reduced angles that are nearer to pi/4 than 1e-4 may belong to either quarter.
const BORDER: f64 = FRAC_PI_4 - 1e-4;

/// Coefficients of `k_sin`, and of `k_cos` below.
const SINE: [f64; 6] = [
    -0.16666666666666632,
    0.00833333333332249,
    -0.0001984126982985795,
    2.755_731_370_707_006_8e-06,
    -2.505_076_025_340_686_3e-08,
    1.589_690_995_211_55e-10,
];

const COSINE: [f64; 6] = [
    0.0416666666666666,
    -0.001388888888887411,
    2.480_158_728_947_673e-05,
    -2.755_731_435_139_066_3e-07,
    2.087_572_321_298_175e-09,
    -1.135_964_755_778_819_5e-11,
];

/// Fills in the sines and cosines of all groups, to the bit those of [`Function::apply`].
pub fn sines_and_cosines(groups: &mut [Angles]) {
    wide(
        #[inline(always)]
        || {
            for group in &mut *groups {
                fill(group);
            }
        },
    );
}

#[inline(always)]
fn fill(group: &mut Angles) {
    if !fill_with(group, reduce::<false>(group.angles)) {
        fill_far(group);
    }
}

/// The same with two rounds of reduction, and what is left to the library.
#[cold]
fn fill_far(group: &mut Angles) {
    let reduced = wide(
        #[inline(always)]
        || {
            let reduced = reduce::<true>(group.angles);
            fill_with(group, reduced);
            reduced
        },
    );
    for (k, angle) in group.angles.into_iter().enumerate().filter(|&(k, _)| reduced.fits[k] == 0) {
        (group.sines[k], group.cosines[k]) = (Function::Sin.apply(angle, 0.0), Function::Cos.apply(angle, 0.0));
    }
}

/// True if all lanes are right.
#[inline(always)]
fn fill_with(group: &mut Angles, reduced: Reduced) -> bool {
    let Reduced { high, low, quarter, inner, fits } = reduced;
    let (sine, cosine) = (sine(high, low, inner), cosine(high, low));
    for k in 0..LANES {
        // Odd quarters exchange both, signs follow from the second bit.
        let odd = 0u64.wrapping_sub(quarter[k] & 1);
        let (s, c) = (sine[k].to_bits(), cosine[k].to_bits());
        let exchanged = (s ^ c) & odd;
        group.sines[k] = f64::from_bits((s ^ exchanged) ^ ((quarter[k] & 2) << 62));
        group.cosines[k] = f64::from_bits((c ^ exchanged) ^ ((quarter[k].wrapping_add(1) & 2) << 62));
    }
    fits[0] & fits[1] & fits[2] & fits[3] != 0
}

/// Angles without their quarter turns.
#[derive(Clone, Copy)]
struct Reduced {
    /// What is left, in two parts.
    high: Lanes,
    low: Lanes,
    /// The quarter, in the last two bits.
    quarter: Masks,
    /// Nothing was taken away.
    inner: Masks,
    /// This is how the library reduces it, too.
    fits: Masks,
}

/// One round of reduction, or two where the first is not enough.
#[inline(always)]
fn reduce<const FAR: bool>(angles: Lanes) -> Reduced {
    let sizes = each(|k| angles[k].abs());
    let inner = masks(|k| sizes[k] < INNER);
    let rounded = each(|k| choose(inner[k], ROUNDING, angles[k] * FRAC_2_PI + ROUNDING));
    let quarters = each(|k| rounded[k] - ROUNDING);
    let first = each(|k| angles[k] - quarters[k] * QUARTER[0]);
    let second = each(|k| quarters[k] * QUARTER[1]);
    let mut high = each(|k| first[k] - second[k]);
    let mut low = each(|k| (first[k] - high[k]) - second[k]);
    let mut enough = masks(|k| cancelled(angles[k], high[k]) <= CANCELLED[0]);
    if FAR {
        let once = enough;
        let coarse = each(|k| quarters[k] * FINER[0]);
        let rest = each(|k| first[k] - coarse[k]);
        let fine = each(|k| quarters[k] * FINER[1] - ((first[k] - rest[k]) - coarse[k]));
        let finer = each(|k| rest[k] - fine[k]);
        let lowest = each(|k| (rest[k] - finer[k]) - fine[k]);
        enough = masks(|k| cancelled(angles[k], finer[k]) <= CANCELLED[1] && sizes[k] >= NEAR);
        enough = bits(|k| enough[k] | once[k]);
        high = each(|k| choose(once[k], high[k], finer[k]));
        low = each(|k| choose(once[k], low[k], lowest[k]));
    }
    let (outer, clear) = (masks(|k| sizes[k] < OUTER), masks(|k| high[k].abs() < BORDER));
    let fits = bits(|k| inner[k] | (outer[k] & clear[k] & enough[k]));
    Reduced { high, low, quarter: bits(|k| rounded[k].to_bits()), inner, fits }
}

/// Bits of a number that are gone in what is left of it; very many where that is larger.
#[inline(always)]
fn cancelled(number: f64, left: f64) -> u64 {
    let exponent = |x: f64| x.to_bits() >> 52 & 0x7FF;
    exponent(number).wrapping_sub(exponent(left))
}

/// `k_sin`: sines of `x + y` with |x| <= pi/4; `y` is nothing in lanes marked `exact`, of which tiny ones are themselves.
#[inline(always)]
fn sine(x: Lanes, y: Lanes, exact: Masks) -> Lanes {
    let z = each(|k| x[k] * x[k]);
    let w = each(|k| z[k] * z[k]);
    let r = each(|k| SINE[1] + z[k] * (SINE[2] + z[k] * SINE[3]) + z[k] * w[k] * (SINE[4] + z[k] * SINE[5]));
    let v = each(|k| z[k] * x[k]);
    let whole = each(|k| x[k] + v[k] * (SINE[0] + z[k] * r[k]));
    let sum = each(|k| x[k] - ((z[k] * (0.5 * y[k] - v[k] * r[k]) - y[k]) - v[k] * SINE[0]));
    let tiny = masks(|k| x[k].abs() < TINY);
    each(|k| choose(exact[k], choose(tiny[k], x[k], whole[k]), sum[k]))
}

/// `k_cos`: cosines of `x + y` with |x| <= pi/4.
#[inline(always)]
fn cosine(x: Lanes, y: Lanes) -> Lanes {
    let z = each(|k| x[k] * x[k]);
    let w = each(|k| z[k] * z[k]);
    let low = each(|k| z[k] * (COSINE[0] + z[k] * (COSINE[1] + z[k] * COSINE[2])));
    let r = each(|k| low[k] + w[k] * w[k] * (COSINE[3] + z[k] * (COSINE[4] + z[k] * COSINE[5])));
    let half = each(|k| 0.5 * z[k]);
    let w = each(|k| 1.0 - half[k]);
    each(|k| w[k] + (((1.0 - w[k]) - half[k]) + (z[k] * r[k] - x[k] * y[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits of sines and cosines, by groups and one by one.
    fn compare(angles: impl Iterator<Item = f64>) -> usize {
        let angles: Vec<f64> = angles.collect();
        let mut own = 0;
        for chunk in angles.chunks_exact(LANES) {
            let mut groups = [Angles { angles: chunk.try_into().expect("four"), ..Angles::default() }];
            sines_and_cosines(&mut groups);
            for (k, &angle) in chunk.iter().enumerate() {
                let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
                assert_eq!(groups[0].sines[k].to_bits(), sine.to_bits(), "sin({angle:?}) is {sine:?}");
                assert_eq!(groups[0].cosines[k].to_bits(), cosine.to_bits(), "cos({angle:?}) is {cosine:?}");
                own += usize::from(reduce::<true>([angle; LANES]).fits[0] != 0);
            }
        }
        own
    }

    /// Numbers of a linear congruence in [0, 1).
    fn scattered(count: usize) -> impl Iterator<Item = f64> {
        let mut state = 0x2545_F491_4F6C_DD1D_u64;
        (0..count).map(move |_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 9_007_199_254_740_992.0
        })
    }

    #[test]
    fn angles_of_every_size_have_the_bits_of_single_calls() {
        for (range, share) in [(0.7, 1.0), (10.0, 0.999), (1e3, 0.999), (1.6e6, 0.999), (3e6, 0.5)] {
            let count = 200_000;
            let own = compare(scattered(count).map(|x| (2.0 * x - 1.0) * range));
            assert!(
                own as f64 >= share * count as f64,
                "only {own} of {count} within {range} are not left to single calls"
            );
        }
        compare(scattered(200_000).map(|x| 10f64.powf(640.0 * x - 330.0)));
    }

    #[test]
    fn angles_beside_every_border_have_the_bits_of_single_calls() {
        let borders = (-40..=40).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
        let far = (1..400).map(|k| f64::from(k * k * k / 64) * std::f64::consts::FRAC_PI_2);
        let others = [INNER, TINY, NEAR, OUTER, BORDER, 2f64.powi(-27), 1_647_099.329_8].into_iter();
        for border in borders.chain(far).chain(others) {
            let near = |k: i64| f64::from_bits(border.to_bits().wrapping_add_signed(k));
            compare((-500..500).map(near));
            compare((-500..500).map(|k| near(k << 22)));
            compare((-500..500).map(|k| border * (1.0 + k as f64 * 1e-6)));
        }
    }

    #[test]
    fn angles_that_cancel_have_the_bits_of_single_calls() {
        // Beside multiples of a quarter turn, near and far, from a tenth of a bit to all of them.
        for most in [4.0, 1e3, 1e6] {
            let mut numbers = scattered(1_200_000);
            let mut number = || numbers.next().expect("enough");
            compare((0..400_000).map(|_| {
                let quarters = (1.0 + (most - 1.0) * number()).round();
                let apart = (2.0 * number() - 1.0) * 2f64.powf(-55.0 * number());
                quarters * std::f64::consts::FRAC_PI_2 * (1.0 + apart)
            }));
        }
    }

    #[test]
    fn zeros_have_a_sign_and_what_is_no_angle_has_no_sine() {
        compare([0.0, -0.0, 1.0, f64::MIN_POSITIVE, -5e-324, 2.0, f64::MAX, f64::MIN].into_iter());
        let mut groups = [Angles { angles: [f64::NAN, f64::INFINITY, 1.0, -0.0], ..Angles::default() }];
        sines_and_cosines(&mut groups);
        let [Angles { sines, cosines, .. }] = groups;
        assert!(sines[0].is_nan() && cosines[0].is_nan() && sines[1].is_nan() && cosines[1].is_nan());
        assert_eq!((sines[2], cosines[2]), (libm::sin(1.0), libm::cos(1.0)));
        assert_eq!((sines[3].to_bits(), cosines[3]), ((-0.0f64).to_bits(), 1.0));
    }
}
