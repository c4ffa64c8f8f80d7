//! Powers of several numbers at once.
//!
//! Flows through orifices and hardening materials are powers other than roots, several in each evaluation.  Four of them take little longer
//! than one: the logarithm to base 2 in two parts, its product with the exponent and the exponential are those of FDLIBM (Sun
//! Microsystems 1993; `e_pow.c`), operation by operation, so that every value has the bits of [`Function::apply`].  What
//! lies where the library's tables of cases decide is left to the library: bases that are not positive and normal, exponents with a
//! name (0, 1, -1, 2 and 1/2) or beyond 2^31, and values near the ends of the range.

use crate::lanes::{LANES, Lanes, Masks, ROUNDING, bits, choose, each, masks, wide};
use crate::math::Function;

/// Four powers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Powers {
    /// Given.
    pub bases: Lanes,
    /// Given.
    pub exponents: Lanes,
    /// The powers.
    pub values: Lanes,
}

/// 2^52, whose last bits take up those of an integer below it.
const WHOLE: f64 = 4_503_599_627_370_496.0;
/// The upper half of a number.
const UPPER: u64 = 0xFFFF_FFFF_0000_0000;
/// Exponent and sign of 1.
const ONE: u64 = 0x3FF0_0000_0000_0000;
const MANTISSA: u64 = 0x000F_FFFF_FFFF_FFFF;
/// Upper halves of mantissas up to which a number belongs to 1, and below which to 3/2; others belong to 2.
const FIRST: u64 = 0x3988E;
const SECOND: u64 = 0xBB67A;
/// Exponents below it, and logarithms of values that are normal in any case.
const LARGEST_EXPONENT: f64 = 2_147_483_648.0;
const LARGEST_LOGARITHM: f64 = 1000.0;

/// Binary logarithm of 3/2 in two parts.
const THREE_HALVES: [f64; 2] = [0.5849624872207642, 1.350_039_202_129_749e-8];
/// Coefficients of the logarithm, and of the exponential below.
const LOGARITHM: [f64; 6] = [
    0.5999999999999946,
    0.4285714285785502,
    0.33333332981837743,
    0.272728123808534,
    0.23066074577556175,
    0.20697501780033842,
];
const EXPONENTIAL: [f64; 5] = [
    0.16666666666666602,
    -0.0027777777777015593,
    6.613_756_321_437_934e-5,
    -1.653_390_220_546_525_2e-6,
    4.138_136_797_057_238_5e-8,
];
/// 2/(3 ln 2), and the same in two parts.
const SCALE: f64 = 0.9617966939259756;
const SCALE_PARTS: [f64; 2] = [0.9617967009544373, -7.028_461_650_952_758e-9];
/// ln 2, and the same in two parts.
const LN_2: f64 = std::f64::consts::LN_2;
const LN_2_PARTS: [f64; 2] = [0.6931471824645996, -1.904_654_299_957_768e-9];

/// Fills in the values of all groups, to the bit those of [`Function::apply`].
pub fn powers(groups: &mut [Powers]) {
    wide(
        #[inline(always)]
        || {
            for group in &mut *groups {
                let (values, fits) = raise(&group.bases, &group.exponents);
                group.values = values;
                if fits[0] & fits[1] & fits[2] & fits[3] == 0 {
                    leave(group, fits);
                }
            }
        },
    );
}

/// What is left to the library.
#[cold]
fn leave(group: &mut Powers, fits: Masks) {
    for k in (0..LANES).filter(|&k| fits[k] == 0) {
        group.values[k] = Function::Pow.apply(group.bases[k], group.exponents[k]);
    }
}

/// Powers, and which of them the library computes in this way, too.
#[inline(always)]
fn raise(x: &Lanes, y: &Lanes) -> (Lanes, Masks) {
    let (high, low) = logarithm(x);
    // (high + low) y, with the upper half of the exponent times `high` exact.
    let upper = each(|k| cut(y[k]));
    let rest = each(|k| (y[k] - upper[k]) * high[k] + y[k] * low[k]);
    let main = each(|k| upper[k] * high[k]);
    let sum = each(|k| rest[k] + main[k]);
    let normal = masks(|k| x[k] >= f64::MIN_POSITIVE && x[k] <= f64::MAX && x[k] != 1.0);
    let own = masks(|k| y[k].abs() < LARGEST_EXPONENT && y[k] != 0.0 && y[k].abs() != 1.0);
    let unnamed = masks(|k| y[k] != 2.0 && y[k] != 0.5 && sum[k].abs() < LARGEST_LOGARITHM);
    let fits = bits(|k| normal[k] & own[k] & unnamed[k]);
    (exponential(&sum, &main, &rest), fits)
}

/// The binary logarithm in two parts.
#[inline(always)]
fn logarithm(x: &Lanes) -> (Lanes, Lanes) {
    let mantissa = bits(|k| x[k].to_bits() & MANTISSA);
    let middle = masks(|k| mantissa[k] >> 32 > FIRST && mantissa[k] >> 32 < SECOND);
    let top = masks(|k| mantissa[k] >> 32 >= SECOND);
    // The number between the roots of 3/4 and 3/2, or of 3/2 and 3.
    let near = bits(|k| (mantissa[k] | ONE) - (top[k] & (1 << 52)));
    let a = each(|k| f64::from_bits(near[k]));
    let whole = bits(|k| (x[k].to_bits() >> 52 & 0x7FF) + (top[k] & 1));
    let n = each(|k| f64::from_bits(WHOLE.to_bits() | whole[k]) - WHOLE - 1023.0);
    let base = each(|k| choose(middle[k], 1.5, 1.0));
    let u = each(|k| a[k] - base[k]);
    let v = each(|k| 1.0 / (a[k] + base[k]));
    let ss = each(|k| u[k] * v[k]);
    let s_h = each(|k| cut(ss[k]));
    let t_h = each(|k| {
        let half = (near[k] >> 33 | 0x2000_0000) + 0x0008_0000 + (middle[k] & 1 << 18);
        f64::from_bits(half << 32)
    });
    let t_l = each(|k| a[k] - (t_h[k] - base[k]));
    let s_l = each(|k| v[k] * ((u[k] - s_h[k] * t_h[k]) - s_h[k] * t_l[k]));
    let s2 = each(|k| ss[k] * ss[k]);
    let [l1, l2, l3, l4, l5, l6] = LOGARITHM;
    let inner = each(|k| l3 + s2[k] * (l4 + s2[k] * (l5 + s2[k] * l6)));
    let r = each(|k| s2[k] * s2[k] * (l1 + s2[k] * (l2 + s2[k] * inner[k])));
    let r = each(|k| r[k] + s_l[k] * (s_h[k] + ss[k]));
    let s2 = each(|k| s_h[k] * s_h[k]);
    let t_h = each(|k| cut(3.0 + s2[k] + r[k]));
    let t_l = each(|k| r[k] - ((t_h[k] - 3.0) - s2[k]));
    let u = each(|k| s_h[k] * t_h[k]);
    let v = each(|k| s_l[k] * t_h[k] + t_l[k] * ss[k]);
    let p_h = each(|k| cut(u[k] + v[k]));
    let p_l = each(|k| v[k] - (p_h[k] - u[k]));
    let z_h = each(|k| SCALE_PARTS[0] * p_h[k]);
    let further = each(|k| choose(middle[k], THREE_HALVES[1], 0.0));
    let z_l = each(|k| SCALE_PARTS[1] * p_h[k] + p_l[k] * SCALE + further[k]);
    let own = each(|k| choose(middle[k], THREE_HALVES[0], 0.0));
    let high = each(|k| cut(((z_h[k] + z_l[k]) + own[k]) + n[k]));
    let low = each(|k| z_l[k] - (((high[k] - n[k]) - own[k]) - z_h[k]));
    (high, low)
}

/// Two to the power of `sum`, which is `main + rest`.
#[inline(always)]
fn exponential(sum: &Lanes, main: &Lanes, rest: &Lanes) -> Lanes {
    // The nearest integer to the upper half, halves away from zero, and none for what is nearly a half.
    let size = each(|k| cut(sum[k]).abs());
    let shifted = each(|k| size[k] + 0.5);
    let rounded = each(|k| (shifted[k] + ROUNDING) - ROUNDING);
    let below = each(|k| if rounded[k] > shifted[k] { rounded[k] - 1.0 } else { rounded[k] });
    let whole = each(|k| if size[k] > 0.5 { below[k].copysign(sum[k]) } else { 0.0 });
    let main = each(|k| main[k] - whole[k]);
    let t = each(|k| cut(rest[k] + main[k]));
    let u = each(|k| t[k] * LN_2_PARTS[0]);
    let v = each(|k| (rest[k] - (t[k] - main[k])) * LN_2 + t[k] * LN_2_PARTS[1]);
    let z = each(|k| u[k] + v[k]);
    let w = each(|k| v[k] - (z[k] - u[k]));
    let t = each(|k| z[k] * z[k]);
    let [p1, p2, p3, p4, p5] = EXPONENTIAL;
    let inner = each(|k| p3 + t[k] * (p4 + t[k] * p5));
    let t1 = each(|k| z[k] - t[k] * (p1 + t[k] * (p2 + t[k] * inner[k])));
    let r = each(|k| (z[k] * t1[k]) / (t1[k] - 2.0) - (w[k] + z[k] * w[k]));
    let z = each(|k| 1.0 - (r[k] - z[k]));
    each(|k| f64::from_bits(z[k].to_bits().wrapping_add((whole[k] + ROUNDING).to_bits() << 52)))
}

/// The upper half of a number.
#[inline(always)]
fn cut(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & UPPER)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with single calls; gives the number of powers that are not left to them.
    fn compare(pairs: impl Iterator<Item = (f64, f64)>) -> usize {
        let pairs: Vec<(f64, f64)> = pairs.collect();
        let mut own = 0;
        for chunk in pairs.chunks_exact(LANES) {
            let [bases, exponents] = [each(|k| chunk[k].0), each(|k| chunk[k].1)];
            let mut groups = [Powers { bases, exponents, ..Powers::default() }];
            powers(&mut groups);
            for (value, &(x, y)) in groups[0].values.iter().zip(chunk) {
                let expected = libm::pow(x, y);
                assert!(
                    value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan(),
                    "{x:?}^{y:?} is {expected:?}, not {value:?}"
                );
            }
            own += raise(&bases, &exponents).1.iter().filter(|&&fits| fits != 0).count();
        }
        own
    }

    /// Numbers of a linear congruence in [0, 1).
    fn scattered() -> impl FnMut() -> f64 {
        let mut state = 0x2545_F491_4F6C_DD1D_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 9_007_199_254_740_992.0
        }
    }

    #[test]
    fn powers_of_every_size_have_the_bits_of_single_calls() {
        let mut number = scattered();
        let count = 200_000;
        for (decades, most, share) in [(3.0, 3.0, 1.0), (20.0, 10.0, 1.0), (300.0, 1.0, 0.99), (300.0, 40.0, 0.05)] {
            let pairs = (0..count).map(|_| {
                let x = 10f64.powf((2.0 * number() - 1.0) * decades);
                (x, (2.0 * number() - 1.0) * most)
            });
            let own = compare(pairs);
            assert!(own as f64 >= share * count as f64, "only {own} of {count}: {decades} decades to {most}");
        }
        // The exponents that models have.
        for y in [0.25, -0.75, 1.75, 0.75, 1.5, -0.5, 1.0 / 3.0, 0.2, 3.0, -2.0, 7.0, 0.6, 1.4, 2.5, -0.25] {
            assert_eq!(compare((0..40_000).map(|_| (10f64.powf(40.0 * number() - 20.0), y))), 40_000);
        }
    }

    #[test]
    fn powers_near_one_and_beside_every_border_have_the_bits_of_single_calls() {
        let mut number = scattered();
        let near = |x: f64, k: i64| f64::from_bits(x.to_bits().wrapping_add_signed(k));
        let roots = [0.75, 1.5, 3.0].map(f64::sqrt);
        let halves = [FIRST, SECOND].map(|half| f64::from_bits(ONE | half << 32));
        for x in roots.into_iter().chain(halves).chain([1.0, 2.0, 0.5, 4.0, 1e-3, 1e3, f64::MIN_POSITIVE]) {
            for y in [0.25, -0.75, 2.5, 300.0, 1e6] {
                compare((-2000..2000).map(|k| (near(x, k), y)));
                compare((-2000..2000).map(|k| (near(x, k << 24), y)));
            }
        }
        // Logarithms of values beside halves and wholes, where the rounding turns, and beside the ends of the range.
        for log in (-20..=20).map(|k| 0.5 * f64::from(k)).chain([999.9, -999.9, 1000.0, 1023.9, -1022.0, -1074.0]) {
            compare((0..4000).map(|_| {
                let y = 0.1 + 3.0 * number();
                let apart = 1.0 + (2.0 * number() - 1.0) * 2f64.powf(-50.0 * number());
                ((log * apart / y).exp2(), y)
            }));
        }
    }

    #[test]
    fn cases_of_the_tables_are_left_to_the_library() {
        let numbers = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            -0.5,
            2.0,
            -2.0,
            3.0,
            -3.0,
            0.25,
            1e-310,
            -5e-324,
            1e300,
            -1e300,
            1e10,
            -1e10,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
            f64::MAX,
            f64::MIN_POSITIVE,
            4_294_967_296.0,
        ];
        compare(numbers.iter().flat_map(|&x| numbers.iter().map(move |&y| (x, y))));
    }
}
