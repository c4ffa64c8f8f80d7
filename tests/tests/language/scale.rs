//! Nothing that is made once per template grows with the number of equal parts; sums of any length are exact.
//!
//! Templates and bytes of code are compared between 4096 and 32768 parts (powers of 8, so that a tree of sums of 8 has no
//! odd ends) and bounded elsewhere; end values of long sums are compared with their closed form.

use hyd_results::{Side, Trajectory};
use hyd_runtime::simulate;
use hyd_system::DaeSystem;
use hyd_tests::runs::{instance, on_grid};
use hyd_tests::scale::{MODELS, translate};

/// Bytes of code may differ by the width in which counts and offsets are encoded.
const ENCODING: usize = 256;

#[test]
fn templates_and_code_do_not_grow() {
    for model in MODELS.into_iter().filter(|&model| model != "Chain") {
        let counts = |parts| translate(model, parts).model.expect("translated").statistics();
        let (small, large, odd) = (counts(4096), counts(32768), counts(10_000));
        assert_eq!(small.templates, large.templates, "{model}");
        assert_eq!(small.templates, odd.templates, "{model}");
        let (least, most) = (small.code_bytes.min(large.code_bytes), small.code_bytes.max(large.code_bytes));
        assert!(most - least <= ENCODING, "{model}: {least} and {most} bytes");
        // Odd ends of a tree of sums are loops of their own, at most seven for each level and kind of sum.
        assert!(odd.code_bytes < 3 * most, "{model}: {} bytes at 10000 parts, {most} at 32768", odd.code_bytes);
    }
}

/// The slope of a straight line through the logarithms.
fn exponent(points: &[(usize, usize)]) -> f64 {
    let logarithms: Vec<(f64, f64)> = points.iter().map(|&(n, value)| ((n as f64).ln(), (value as f64).ln())).collect();
    let count = logarithms.len() as f64;
    let mean = logarithms.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / count, sum.1 + point.1 / count));
    let product = |f: &dyn Fn(&(f64, f64)) -> f64| logarithms.iter().map(f).sum::<f64>();
    product(&|p| (p.0 - mean.0) * (p.1 - mean.1)) / product(&|p| (p.0 - mean.0) * (p.0 - mean.0))
}

/// Where everything meets in one place (a node, a mean), neither code nor Jacobian grows faster than the number of
/// parts, whether the code is straight or made of loops; and no template is added per part.  Exponents are fitted from
/// 64 parts on, where the width of assignments is bounded: there a fold becomes an unknown, so its entries step from 2
/// to 8 per part.
#[test]
fn stars_of_any_size_grow_no_faster_than_their_branches() {
    for model in ["Star", "Mean", "Junction", "Folds"] {
        let (mut bytes, mut entries) = (Vec::new(), Vec::new());
        for parts in [16, 32, 64, 128, 256, 512, 1024, 2048, 4096] {
            let compilation = translate(model, parts);
            let counts = compilation.model.as_ref().expect("translated").statistics();
            let system = instance(&compilation, &[]);
            let structure = system.structure();
            assert!(counts.templates <= 20, "{model} of {parts}: {counts:?}");
            assert!(counts.code_bytes < 2000 * parts && counts.code_bytes < 300_000, "{model} of {parts}: {counts:?}");
            let count = structure.state_pattern.entries() + structure.rate_pattern.entries();
            assert!(count < 40 * parts, "{model} of {parts}: {count} entries of the Jacobian");
            if parts >= 64 {
                bytes.push((parts, counts.code_bytes));
                entries.push((parts, count));
            }
        }
        for (what, points) in [("bytes of code", bytes), ("entries of the Jacobian", entries)] {
            assert!(exponent(&points) <= 1.1, "{model}: {what} {points:?}");
        }
    }
}

/// Components that are declared one by one share templates too.
#[test]
fn a_chain_declared_by_hand_shares_its_templates() {
    let counts = |parts| translate("Chain", parts).model.expect("translated").statistics();
    let (small, large) = (counts(1_000), counts(3_000));
    assert_eq!(small.templates, large.templates);
    assert!(large.code_bytes < small.code_bytes + ENCODING, "{small:?} {large:?}");
}

fn end_values(model: &str, parts: usize, variables: &[&str]) -> Vec<f64> {
    let compilation = translate(model, parts);
    let mut system = instance(&compilation, &[]);
    let mut rows = Trajectory::new();
    simulate(&mut system, &on_grid(1.0, 1, 1e-8), &mut rows, &|| false)
        .unwrap_or_else(|error| panic!("{model}: {error}"));
    let value = |name: &&str| rows.series(name).unwrap_or_else(|| panic!("no `{name}`")).value(1.0, Side::After);
    variables.iter().map(value).collect()
}

/// `x_i(1) = exp(-1/(1 + i/N))`; all folds follow from that.
#[test]
fn long_folds_have_the_values_of_their_closed_form() {
    for parts in [33, 1000, 3001] {
        let n = parts as f64;
        let x: Vec<f64> = (1..=parts).map(|i| (-1.0 / (1.0 + i as f64 / n)).exp()).collect();
        let indexed = || x.iter().enumerate().map(|(k, x)| (k as f64 + 1.0, x));
        let expected = [
            x.iter().sum(),
            indexed().map(|(i, x)| x / i).sum(),
            indexed().map(|(i, x)| i * x * x).sum(),
            x.iter().map(|x| 1.0 + x / n).product::<f64>(),
            x.iter().copied().fold(f64::INFINITY, f64::min),
            x.iter().copied().fold(0.0, f64::max),
        ];
        let found = end_values("Folds", parts, &["total", "dot", "weighted", "all", "least", "most"]);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{parts} parts: {found}, not {expected}");
        }
    }
}

/// The node of a star lies at the mean voltage m, and `u_i(1) = m + (u_i(0) - m) exp(-1/2)`.
#[test]
fn a_star_of_many_branches_discharges_to_the_mean() {
    for parts in [33, 1000, 3001] {
        let n = parts as f64;
        let mean = (n + 1.0) / (2.0 * n);
        let expected = |i: f64| mean + (i / n - mean) * (-0.5f64).exp();
        let found = end_values("Star", parts, &["r[1].u", &format!("r[{parts}].u")]);
        for (found, expected) in found.iter().zip([expected(1.0), expected(n)]) {
            assert!((found - expected).abs() < 1e-7, "{parts} parts: {found}, not {expected}");
        }
    }
}
