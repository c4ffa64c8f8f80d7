//! Equations that determine variables together: Newton's method with differences and dense elimination.

use super::machine::Machine;
use super::value::{Done, Dual};
use crate::model::{Equation, Id};

/// Iterations of Newton's method at most.
const MOST: usize = 50;

/// Solves `A x = b` by elimination with row pivots.
pub(super) fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Done<Vec<f64>> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        if a[pivot][k].abs() < 1e-9 {
            return Err("unclear: a singular loop".into());
        }
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            if factor != 0.0 {
                let row = a[k].clone();
                a[i].iter_mut().zip(row).skip(k).for_each(|(x, y)| *x -= factor * y);
                b[i] -= factor * b[k];
            }
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    Ok(b)
}

/// Largest magnitude.
fn largest(list: &[f64]) -> f64 {
    list.iter().fold(0.0, |a: f64, b| if b.is_nan() { f64::NAN } else { a.max(b.abs()) })
}

/// Finds `u` with `f(u) = 0`; `f` is called at the solution last.
pub(super) fn newton(u: &mut [f64], f: &mut dyn FnMut(&[f64]) -> Done<Vec<f64>>) -> Done<()> {
    let mut last = f64::INFINITY;
    let mut a: Vec<Vec<f64>> = Vec::new();
    for _ in 0..MOST {
        let r = f(u)?;
        if r.len() != u.len() {
            return Err(format!("{} equations for {} unknowns", r.len(), u.len()));
        }
        let size = largest(&r);
        if size.is_nan() {
            return Err("unclear: no number in a loop".into());
        }
        // Convergence down to rounding: as far as it still gets better.
        if size < 1e-14 || (size < 1e-11 && size >= 0.25 * last) {
            return Ok(());
        }
        // The matrix is made anew where it does not serve any more.
        let renew = a.is_empty() || size > 0.1 * last;
        last = size;
        if renew {
            a = vec![vec![0.0; u.len()]; u.len()];
        }
        for j in (0..u.len()).filter(|_| renew) {
            let mut moved = u.to_vec();
            let h = 1e-6 * (1.0 + u[j].abs());
            moved[j] = u[j] + h;
            let up = f(&moved)?;
            moved[j] = u[j] - h;
            let down = f(&moved)?;
            for i in 0..u.len() {
                a[i][j] = (up[i] - down[i]) / (2.0 * h);
            }
        }
        let step = solve(a.clone(), r)?;
        u.iter_mut().zip(&step).for_each(|(u, s)| *u -= s);
    }
    Err("unclear: a loop without convergence".into())
}

impl Machine<'_> {
    fn residuals(&mut self, list: &[Equation], into: &mut Vec<Dual>) -> Done<()> {
        for equation in list {
            match equation {
                Equation::Plain(a, b) => {
                    let (a, b) = (self.number(a)?, self.number(b)?);
                    into.push(Dual { v: a.v - b.v, d: a.d - b.d });
                }
                Equation::Loop(name, range, body) => {
                    self.each(name, range, &mut |machine| machine.residuals(body, into).map(|()| true))?;
                }
            }
        }
        Ok(())
    }

    fn put(&mut self, unknowns: &[Id], u: &[f64], d: &[f64]) {
        let mut numbers = u.iter().zip(d);
        for id in unknowns {
            for place in &mut self.memory[*id] {
                if let Some((v, d)) = numbers.next() {
                    *place = Dual { v: *v, d: *d };
                }
            }
        }
    }

    /// Solves equations for variables, and then for their derivatives in time.
    pub(super) fn implicit(&mut self, unknowns: &[Id], equations: &[Equation]) -> Done<()> {
        let mut u: Vec<f64> = unknowns.iter().flat_map(|id| self.memory[*id].iter().map(|x| x.v)).collect();
        let (trace, site) = (self.trace.position, self.site);
        let zero = vec![0.0; u.len()];
        let at = |machine: &mut Self, u: &[f64], d: &[f64]| -> Done<Vec<Dual>> {
            machine.put(unknowns, u, d);
            machine.trace.rewind(trace);
            machine.site = site;
            let mut list = Vec::new();
            machine.residuals(equations, &mut list)?;
            Ok(list)
        };
        newton(&mut u, &mut |u| Ok(at(self, u, &zero)?.iter().map(|r| r.v).collect()))?;
        if !self.derives {
            return at(self, &u, &zero).map(|_| ());
        }
        let still = at(self, &u, &zero)?;
        let mut a = vec![vec![0.0; u.len()]; u.len()];
        for j in 0..u.len() {
            let mut unit = zero.clone();
            unit[j] = 1.0;
            for (i, r) in at(self, &u, &unit)?.iter().enumerate() {
                a[i][j] = r.d - still[i].d;
            }
        }
        let d = match still.iter().all(|r| r.d.is_finite()) {
            true => solve(a, still.iter().map(|r| -r.d).collect())?,
            false => vec![f64::NAN; u.len()],
        };
        at(self, &u, &d).map(|_| ())
    }
}
