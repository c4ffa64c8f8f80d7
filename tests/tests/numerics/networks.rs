//! Linear networks have the solution of their matrix, whatever the order in which the translation eliminates.
//!
//! Chains, ladders, trees, grids, rods and springs are symmetric positive definite; the solution to compare with is Cholesky's
//! factorisation of a band matrix that is put together here, which is backward stable without pivoting (Higham 2002, *Accuracy
//! and Stability of Numerical Algorithms*, theorem 10.3).

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile, compile_whole_loops};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{SolveError, simulate};
use hyd_system::DaeSystem;
use hyd_tests::models::{messages, text_of};
use hyd_tests::runs::{instance, on_grid};

/// Conductances between nodes and to a level of 1 or 0, of a network with numbered nodes.
struct Network {
    band: usize,
    matrix: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl Network {
    fn new(nodes: usize, band: usize) -> Self {
        Self { band, matrix: vec![vec![0.0; band + 1]; nodes], right: vec![0.0; nodes] }
    }

    /// Between two nodes; entry `d` of row `i` is that of column `i - d`.
    fn link(&mut self, a: usize, b: usize, g: f64) {
        let (low, high) = (a.min(b), a.max(b));
        self.matrix[low][0] += g;
        self.matrix[high][0] += g;
        self.matrix[high][high - low] -= g;
    }

    /// To a level.
    fn level(&mut self, node: usize, g: f64, value: f64) {
        self.matrix[node][0] += g;
        self.right[node] += g * value;
    }

    /// The largest residual of an equation beside its terms (Oettli and Prager 1964).
    fn backward_error(&self, x: &[f64]) -> f64 {
        let mut sums: Vec<(f64, f64)> = self.right.iter().map(|b| (-b, b.abs())).collect();
        let mut add = |row: usize, term: f64| {
            sums[row].0 += term;
            sums[row].1 += term.abs();
        };
        for i in 0..x.len() {
            add(i, self.matrix[i][0] * x[i]);
            for d in 1..=self.band.min(i) {
                add(i, self.matrix[i][d] * x[i - d]);
                add(i - d, self.matrix[i][d] * x[i]);
            }
        }
        sums.into_iter().fold(0.0, |largest, (sum, size)| largest.max(sum.abs() / size))
    }

    fn solve(mut self) -> Vec<f64> {
        let (n, band) = (self.right.len(), self.band);
        for i in 0..n {
            for d in (0..=band.min(i)).rev() {
                let j = i - d;
                let shared = (1..=band.min(j)).filter(|k| k + d <= band);
                let sum: f64 = shared.map(|k| self.matrix[i][k + d] * self.matrix[j][k]).sum();
                let value = self.matrix[i][d] - sum;
                self.matrix[i][d] = if d == 0 { value.sqrt() } else { value / self.matrix[j][0] };
            }
        }
        let mut x = self.right;
        for i in 0..n {
            let sum: f64 = (1..=band.min(i)).map(|d| self.matrix[i][d] * x[i - d]).sum();
            x[i] = (x[i] - sum) / self.matrix[i][0];
        }
        for i in (0..n).rev() {
            x[i] /= self.matrix[i][0];
            for d in 1..=band.min(i) {
                x[i - d] -= self.matrix[i][d] * x[i];
            }
        }
        x
    }
}

/// The values that the models give their elements, from 1.
fn sizes(ratio: f64, scale: f64) -> (impl Fn(usize) -> f64, impl Fn(usize) -> f64) {
    let r = move |k: usize| scale * ratio.powf((7 * k % 11) as f64 / 10.0);
    let s = move |k: usize| scale * ratio.powf((3 * k % 13) as f64 / 12.0);
    (r, s)
}

/// A row of conductances `along`, each node with one of `across` to the level `ground`.
fn row(n: usize, along: impl Fn(usize) -> f64, across: impl Fn(usize) -> f64, levels: (f64, f64)) -> Vec<f64> {
    row_network(n, along, across, levels).solve()
}

fn row_network(
    n: usize,
    along: impl Fn(usize) -> f64,
    across: impl Fn(usize) -> f64,
    (fed, ground): (f64, f64),
) -> Network {
    let mut network = Network::new(n, 1);
    for k in 0..n {
        network.level(k, across(k + 1), ground);
        match k {
            0 => network.level(0, along(1), fed),
            _ => network.link(k - 1, k, along(k + 1)),
        }
    }
    network
}

fn translate(model: &str, set: &[(&str, String)]) -> Compilation {
    let text = text_of("tests/cases/networks/networks.hyd");
    let set = set.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
    let options = Options { model: Some(format!("Networks.{model}")), set, goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "networks.hyd", &text, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    compilation
}

/// Values at the start and at 0.5 s of `variable(k)` for k from 1 to n.
fn values(model: &str, set: &[(&str, String)], variable: impl Fn(usize) -> String, n: usize) -> [Vec<f64>; 2] {
    values_at(model, set, variable, 1..=n)
}

/// The same for some elements.
fn values_at(
    model: &str,
    set: &[(&str, String)],
    variable: impl Fn(usize) -> String,
    elements: impl Iterator<Item = usize> + Clone,
) -> [Vec<f64>; 2] {
    let compilation = translate(model, set);
    let borrowed: Vec<(&str, &str)> = set.iter().map(|(name, value)| (*name, value.as_str())).collect();
    let mut system = instance(&compilation, &borrowed);
    let mut rows = Trajectory::new();
    let result = simulate(&mut system, &on_grid(0.5, 5, 1e-6), &mut rows, &|| false);
    result.unwrap_or_else(|error| panic!("{model} {set:?}: {error}"));
    [0.0, 0.5].map(|t| {
        let value = |k| rows.series(&variable(k)).expect("a variable of the model").value(t, Side::After);
        elements.clone().map(value).collect()
    })
}

/// Relative to the largest value: the sources differ from element to element by no more than that.
fn assert_near(what: &str, found: &[f64], right: &[f64], factor: f64, allowed: f64) {
    let largest = right.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    for (k, (found, right)) in found.iter().zip(right).enumerate() {
        let error = (found - factor * right).abs() / largest;
        assert!(error <= allowed, "{what}: element {} is {found} instead of {}", k + 1, factor * right);
    }
}

fn at(n: usize, ratio: f64, scale: f64) -> Vec<(&'static str, String)> {
    vec![("n", n.to_string()), ("ratio", format!("{ratio:e}")), ("scale", format!("{scale:e}"))]
}

const SIZES: [usize; 5] = [3, 10, 60, 200, 1000];
const RATIOS: [f64; 4] = [1.0, 10.0, 1e3, 1e6];
/// Of sixteen digits, three may be lost between unknowns and some to the condition of the matrix.
const ALLOWED: f64 = 1e-9;

#[test]
fn chains() {
    for n in SIZES {
        for ratio in RATIOS {
            let (r, s) = sizes(ratio, 1.0);
            // The level to which every element of the chain is tied is u; the first one is tied to 0, too.
            let right = row(n, r, s, (0.0, 1.0));
            let what = format!("chain of {n}, ratio {ratio}");
            let [start, end] = values("Chain", &at(n, ratio, 1.0), |k| format!("x[{k}]"), n);
            assert_near(&what, &start, &right, 1.0, ALLOWED);
            assert_near(&what, &end, &right, (-0.5_f64).exp(), 1e-5);
        }
    }
}

#[test]
fn chains_between_derivatives() {
    for n in [3, 10, 60, 200] {
        for ratio in [1.0, 1e6] {
            let (r, s) = sizes(ratio, 1.0);
            let right = row(n, r, s, (0.0, 1.0));
            let [start, end] = values("Rates", &at(n, ratio, 1.0), |k| format!("y[{k}]"), n);
            let what = format!("derivatives of a chain of {n}, ratio {ratio}");
            assert_near(&what, &start, &right, -1.0, ALLOWED);
            assert_near(&what, &end, &right, -(-0.5_f64).exp(), 1e-5);
        }
    }
}

#[test]
fn ladders_of_resistors() {
    for n in SIZES {
        for (ratio, scale) in RATIOS.map(|ratio| (ratio, 1.0)).into_iter().chain([(1.0, 1e9), (1e3, 1e9)]) {
            let (r, s) = sizes(ratio, scale);
            let right = row(n, |k| 1.0 / r(k), |k| 1.0 / s(k), (1.0, 0.0));
            let [start, end] = values("Ladder", &at(n, ratio, scale), |k| format!("across[{k}].p.v"), n);
            let what = format!("ladder of {n}, ratio {ratio}, scale {scale}");
            assert_near(&what, &start, &right, 1.0, ALLOWED);
            assert_near(&what, &end, &right, 0.5_f64.cos(), ALLOWED);
        }
    }
}

#[test]
fn trees_of_resistors() {
    for n in [3, 10, 60, 200] {
        for ratio in RATIOS {
            let (r, s) = sizes(ratio, 1.0);
            let mut network = Network::new(n, n - 1);
            for k in 1..=n {
                network.level(k - 1, 1.0 / s(k), 0.0);
                match k {
                    1 => network.level(0, 1.0 / r(1), 1.0),
                    _ => network.link(k / 2 - 1, k - 1, 1.0 / r(k)),
                }
            }
            let right = network.solve();
            let [start, end] = values("Tree", &at(n, ratio, 1.0), |k| format!("across[{k}].p.v"), n);
            assert_near(&format!("tree of {n}, ratio {ratio}"), &start, &right, 1.0, ALLOWED);
            assert_near(&format!("tree of {n}, ratio {ratio}"), &end, &right, 0.5_f64.cos(), ALLOWED);
        }
    }
}

#[test]
fn grids_of_resistors() {
    for m in [2, 5, 12, 25] {
        for ratio in RATIOS {
            let n = m * m;
            let (r, s) = sizes(ratio, 1.0);
            let mut network = Network::new(n, m);
            network.level(0, 1.0, 1.0);
            for i in 0..m {
                for j in 0..m {
                    let k = m * i + j;
                    network.level(k, 1.0 / r(k + 1), 0.0);
                    if j + 1 < m {
                        network.link(k, k + 1, 1.0 / r(k + 1));
                    }
                    if i + 1 < m {
                        network.link(k, k + m, 1.0 / s(k + 1));
                    }
                }
            }
            let right = network.solve();
            let set = [("m", m.to_string()), ("ratio", format!("{ratio:e}"))];
            let name = |k: usize| format!("across[{},{}].p.v", (k - 1) / m + 1, (k - 1) % m + 1);
            let [start, end] = values("Grid", &set, name, n);
            assert_near(&format!("grid of {m} by {m}, ratio {ratio}"), &start, &right, 1.0, ALLOWED);
            assert_near(&format!("grid of {m} by {m}, ratio {ratio}"), &end, &right, 0.5_f64.cos(), ALLOWED);
        }
    }
}

#[test]
fn rods_that_start_at_rest() {
    for n in [3, 10, 60, 200] {
        for ratio in RATIOS {
            let (r, s) = sizes(ratio, 1.0);
            let right = row(n, r, s, (1.0, 0.0));
            let [start, end] = values("Rod", &at(n, ratio, 1.0), |k| format!("T[{k}]"), n);
            assert_near(&format!("rod of {n}, ratio {ratio}"), &start, &right, 1.0, ALLOWED);
            assert_near(&format!("rod of {n}, ratio {ratio}"), &end, &right, 1.0, 1e-6);
        }
    }
}

#[test]
fn springs_in_a_row() {
    for n in SIZES {
        for (ratio, scale) in RATIOS.map(|ratio| (ratio, 1.0)).into_iter().chain([(1e3, 1e8)]) {
            let (r, s) = sizes(ratio, scale);
            let right = row(n, r, s, (1.0, 0.0));
            let [start, end] = values("Springs", &at(n, ratio, scale), |k| format!("across[{k}].a.s"), n);
            assert_near(&format!("{n} springs, ratio {ratio}, scale {scale}"), &start, &right, 1.0, ALLOWED);
            assert_near(&format!("{n} springs, ratio {ratio}, scale {scale}"), &end, &right, 1.0, ALLOWED);
        }
    }
}

/// Values that were not those at translation may let errors grow: the run says so, or it is right.
#[test]
fn values_given_after_translation_are_right_or_refused() {
    let (n, mut rounding) = (60, 0);
    let compilation = translate("Chain", &at(n, 1.0, 1.0)[..1]);
    for exponent in 0..12 {
        let (r, s) = sizes(10.0_f64.powi(exponent), 1.0);
        let network = row_network(n, r, s, (0.0, 1.0));
        let mut system = instance(&compilation, &[("ratio", &format!("1e{exponent}"))]);
        let mut rows = Trajectory::new();
        match simulate(&mut system, &on_grid(0.5, 5, 1e-6), &mut rows, &|| false) {
            Ok(_) => {
                let value = |k| rows.series(&format!("x[{k}]")).expect("a variable").value(0.0, Side::After);
                let found: Vec<f64> = (1..=n).map(value).collect();
                // What the run itself allows of the terms of an equation; of all terms in a row they are some.
                let error = network.backward_error(&found);
                assert!(error < 1e-6, "ratio 1e{exponent}: an equation is off by {error:e} of its terms");
            }
            Err(SolveError::Rounding { equation, .. }) => {
                assert!(equation.is_some_and(|equation| equation.text.contains("x[")));
                rounding += 1;
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert!(rounding > 0, "no ratio makes errors grow: the test shows nothing");
}

/// Loops that are not torn give the same values.
#[test]
fn whole_loops() {
    let text = text_of("tests/cases/networks/networks.hyd");
    let (r, s) = sizes(1e3, 1.0);
    let right = row(60, |k| 1.0 / r(k), |k| 1.0 / s(k), (1.0, 0.0));
    let set = at(60, 1e3, 1.0).into_iter().map(|(name, value)| (name.to_string(), value)).collect();
    let options = Options { model: Some("Networks.Ladder".to_string()), set, goal: Goal::Run, clock: || 0.0 };
    let compilation = compile_whole_loops(&mut LibraryPath::new(), "networks.hyd", &text, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    let mut rows = Trajectory::new();
    let mut system = instance(&compilation, &[("ratio", "1e3")]);
    simulate(&mut system, &on_grid(0.5, 5, 1e-6), &mut rows, &|| false).expect("runs");
    assert!(system.torn_loops().is_none());
    let value = |k| rows.series(&format!("across[{k}].p.v")).expect("a variable").value(0.0, Side::After);
    assert_near("whole ladder", &(1..=60).map(value).collect::<Vec<_>>(), &right, 1.0, ALLOWED);
}

/// Loops of code and sparse factors; some elements, because each is looked up by its name.
#[test]
fn long_ladders_and_chains() {
    let n = 100_000;
    let (r, s) = sizes(10.0, 1.0);
    let elements = || (1..=n).step_by(5_000).chain(n - 20..=n);
    let some = |all: Vec<f64>| elements().map(|k| all[k - 1]).collect::<Vec<_>>();
    let right = some(row(n, |k| 1.0 / r(k), |k| 1.0 / s(k), (1.0, 0.0)));
    let [start, _] = values_at("Ladder", &at(n, 10.0, 1.0), |k| format!("across[{k}].p.v"), elements());
    assert_near("ladder of 100000", &start, &right, 1.0, ALLOWED);
    let right = some(row(n, r, s, (0.0, 1.0)));
    let [start, _] = values_at("Chain", &at(n, 10.0, 1.0), |k| format!("x[{k}]"), elements());
    assert_near("chain of 100000", &start, &right, 1.0, ALLOWED);
}
