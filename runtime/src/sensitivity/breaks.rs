//! Instants between accepted points at which the coefficients of the sensitivities jump without an event.
//!
//! A contact written without an event, a `sign`, a `max`: the solution goes through smoothly, the Jacobian does not.
//! The system tells the arguments of such branches; where one changes its sign between two points of the solution the
//! instant is enclosed on the interpolant (regula falsi with bisection), and the steps of the sensitivities end before
//! it and begin anew behind it.  Branches that meet smoothly cause no break.

use super::linear::Matrices;
use super::trail::Trail;
use crate::problem::Problem;

/// Width of the enclosure, as a part of the distance of the points.
const WIDTH: f64 = 1e-9;
/// Most evaluations to enclose an instant, and most instants between two points.
const MOST_EVALUATIONS: usize = 60;
const MOST_BREAKS: usize = 8;

/// The breaks that the sensitivities have still to pass.
pub(super) struct Breaks {
    /// Just before and just behind, ascending.
    list: Vec<(f64, f64)>,
    left: Vec<f64>,
    right: Vec<f64>,
    trial: Vec<f64>,
    end: Vec<f64>,
    y: Vec<f64>,
    yp: Vec<f64>,
    t: f64,
}

impl Breaks {
    /// Room for systems of n unknowns.
    pub(super) fn new(n: usize) -> Self {
        let none = Vec::new;
        Self {
            list: Vec::new(),
            left: none(),
            right: none(),
            trial: none(),
            end: none(),
            y: vec![0.0; n],
            yp: vec![0.0; n],
            t: 0.0,
        }
    }

    /// Forgets all breaks: the solution begins anew at a point.
    pub(super) fn restart(&mut self, problem: &mut Problem<'_>, t: f64, y: &[f64], yp: &[f64]) {
        self.list.clear();
        let count = problem.system.branches();
        for values in [&mut self.left, &mut self.right, &mut self.trial, &mut self.end] {
            values.resize(count, 0.0);
        }
        self.t = t;
        if count > 0 {
            problem.system.branch_values(t, y, yp, &mut self.left);
        }
    }

    /// Branches without an event are known, so that no step crosses one.
    pub(super) fn located(&self) -> bool {
        !self.left.is_empty()
    }

    /// The next break, if there is one.
    pub(super) fn next(&self) -> Option<(f64, f64)> {
        self.list.first().copied()
    }

    /// The next break is passed.
    pub(super) fn pass(&mut self) {
        self.list.remove(0);
    }

    /// Looks for breaks before the newest point of the trail, which is `(t, y, y')`.
    pub(super) fn look(
        &mut self,
        problem: &mut Problem<'_>,
        matrices: &mut Matrices,
        trail: &Trail,
        (t, y, yp): (f64, &[f64], &[f64]),
    ) {
        if self.left.is_empty() {
            return;
        }
        problem.system.branch_values(t, y, yp, &mut self.end);
        for _ in 0..MOST_BREAKS {
            if same_sides(&self.left, &self.end) {
                break;
            }
            self.right.copy_from_slice(&self.end);
            let found = self.enclose(problem, trail, t);
            if matrices.jump_between(problem, trail, found) {
                self.list.push(found);
            }
            self.t = found.1;
            std::mem::swap(&mut self.left, &mut self.right);
        }
        std::mem::swap(&mut self.left, &mut self.end);
        self.t = t;
    }

    /// Encloses the first change between `self.t` with the values `left` and `t` with the values `right`, which become those of the
    /// enclosure.
    fn enclose(&mut self, problem: &mut Problem<'_>, trail: &Trail, t: f64) -> (f64, f64) {
        let (mut a, mut b) = (self.t, t);
        let width = (WIDTH * (b - a)).max(8.0 * f64::EPSILON * b.abs());
        let mut halve = false;
        for _ in 0..MOST_EVALUATIONS {
            if b - a <= width {
                break;
            }
            let part = if halve { 0.5 } else { self.crossing() };
            let before = b - a;
            let trial = a + part * before;
            trail.values(trial, &mut self.y, &mut self.yp);
            problem.system.branch_values(trial, &self.y, &self.yp, &mut self.trial);
            if same_sides(&self.left, &self.trial) {
                a = trial;
                std::mem::swap(&mut self.left, &mut self.trial);
            } else {
                b = trial;
                std::mem::swap(&mut self.right, &mut self.trial);
            }
            halve = b - a > 0.5 * before;
        }
        (a, b)
    }

    /// Where the first of the values crosses zero if they are linear, as a part of the interval, a little inside of its ends.
    fn crossing(&self) -> f64 {
        let changed = self.left.iter().zip(&self.right).filter(|(a, b)| (**a > 0.0) != (**b > 0.0));
        let first = changed.map(|(a, b)| a / (a - b)).fold(1.0, f64::min);
        if first.is_finite() { first.clamp(1e-4, 1.0 - 1e-4) } else { 0.5 }
    }
}

fn same_sides(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (*a > 0.0) == (*b > 0.0))
}
