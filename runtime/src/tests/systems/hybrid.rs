//! Systems with events, and systems that must fail.
#![allow(clippy::disallowed_methods)]

use super::Model;
use hyd_system::{EventChange, EventPhase};

/// A ball of height h and velocity v, bouncing with restitution `e`; `count` bounces.
pub(crate) struct Ball {
    pub restitution: f64,
    below: bool,
    count: f64,
    /// Ends the run at this bounce.
    pub last: f64,
}

impl Ball {
    pub(crate) const GRAVITY: f64 = 9.81;

    pub(crate) fn new(restitution: f64, last: f64) -> Self {
        Self { restitution, below: false, count: 0.0, last }
    }
}

impl Model for Ball {
    fn names(&self) -> Vec<String> {
        vec!["h".into(), "v".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![1.0, 0.0]
    }
    fn bind(&mut self) {
        self.below = false;
        self.count = 0.0;
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - y[1];
        out[1] = yp[1] + Self::GRAVITY;
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state[2] = -1.0;
        rate.copy_from_slice(&[1.0, 0.0, 0.0, 1.0]);
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["h <= 0"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = -y[0];
    }
    fn held(&self, out: &mut [bool]) {
        out[0] = self.below;
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        let below = y[0] < 0.0;
        let mut change = EventChange { changed: below != self.below, ..EventChange::default() };
        if below && !self.below {
            y[1] *= -self.restitution;
            self.count += 1.0;
            change.reinitialised = true;
            if self.count >= self.last {
                change.terminated = Some("enough".into());
            }
        }
        self.below = below;
        change
    }
    fn discrete(&self) -> Vec<(&'static str, f64)> {
        vec![("count", self.count)]
    }
}

/// x' = 1, and the relation `(x - 0.5)^2 < width^2`, true for `2 width` seconds; `count` counts how often it became true.
pub(crate) struct Touch {
    pub width: f64,
    near: bool,
    count: f64,
}

impl Touch {
    pub(crate) fn new(width: f64) -> Self {
        Self { width, near: false, count: 0.0 }
    }
}

impl Model for Touch {
    fn names(&self) -> Vec<String> {
        vec!["x".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![0.0]
    }
    fn bind(&mut self) {
        (self.near, self.count) = (false, 0.0);
    }
    fn residual(&self, _t: f64, _y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - 1.0;
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], _state: &mut [f64], rate: &mut [f64]) {
        rate[0] = 1.0;
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["(x - 0.5)^2 < width^2"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = self.width.powi(2) - (y[0] - 0.5).powi(2);
    }
    fn held(&self, out: &mut [bool]) {
        out[0] = self.near;
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        let near = (y[0] - 0.5).abs() < self.width;
        let changed = near != self.near;
        self.count += f64::from(near && !self.near);
        self.near = near;
        EventChange { changed, ..EventChange::default() }
    }
    fn discrete(&self) -> Vec<(&'static str, f64)> {
        vec![("count", self.count)]
    }
}

/// tau u' = s - u with s switching between 1 and 0 every `half` seconds.
pub(crate) struct SwitchedRc {
    pub tau: f64,
    pub half: f64,
    on: bool,
}

impl SwitchedRc {
    pub(crate) fn new(tau: f64, half: f64) -> Self {
        Self { tau, half, on: true }
    }

    /// u(t) from u(0) = 0, piece by piece.
    pub(crate) fn exact(&self, t: f64) -> f64 {
        let (mut u, mut from, mut source) = (0.0, 0.0, 1.0);
        while from + self.half < t {
            u = source + (u - source) * (-self.half / self.tau).exp();
            from += self.half;
            source = 1.0 - source;
        }
        source + (u - source) * (-(t - from) / self.tau).exp()
    }
}

impl Model for SwitchedRc {
    fn names(&self) -> Vec<String> {
        vec!["u".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![0.0]
    }
    fn bind(&mut self) {
        self.on = true;
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = self.tau * yp[0] + y[0] - f64::from(self.on);
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        (state[0], rate[0]) = (1.0, self.tau);
    }
    fn next_time_event(&self, t: f64) -> f64 {
        let next = ((t / self.half).floor() + 1.0) * self.half;
        if next > t { next } else { next + self.half }
    }
    fn event(&mut self, phase: EventPhase, _t: f64, _y: &mut [f64], _yp: &[f64]) -> EventChange {
        let changed = phase == EventPhase::First;
        self.on ^= changed;
        EventChange { changed, ..EventChange::default() }
    }
}

/// x' = 1, w = x - 0.5 (algebraic); at w > 0 the algebraic equation becomes w = 2 (x - 0.5) + 1 and the clock `jumped` is set.
pub(crate) struct AlgebraicSwitch {
    pub above: bool,
}

impl Model for AlgebraicSwitch {
    fn names(&self) -> Vec<String> {
        vec!["x".into(), "w".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![0.0, 3.0]
    }
    fn differential(&self) -> Vec<bool> {
        vec![true, false]
    }
    fn bind(&mut self) {
        self.above = false;
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - 1.0;
        out[1] = if self.above { y[1] - 2.0 * (y[0] - 0.5) - 1.0 } else { y[1] - (y[0] - 0.5) };
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state[1] = if self.above { -2.0 } else { -1.0 };
        state[3] = 1.0;
        rate[0] = 1.0;
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["w > 0"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = y[1];
    }
    fn held(&self, out: &mut [bool]) {
        out[0] = self.above;
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        let above = y[1] > 0.0;
        let changed = above != self.above;
        self.above = above;
        EventChange { changed, ..EventChange::default() }
    }
}

/// x' = -sign(x), the relation `x > 0` switching back and forth at zero.
pub(crate) struct Chatterer {
    positive: bool,
}

impl Chatterer {
    pub(crate) fn new() -> Self {
        Self { positive: true }
    }
}

impl Model for Chatterer {
    fn names(&self) -> Vec<String> {
        vec!["x".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![0.25]
    }
    fn bind(&mut self) {
        self.positive = true;
    }
    fn residual(&self, _t: f64, _y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] + if self.positive { 1.0 } else { -1.0 };
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], _state: &mut [f64], rate: &mut [f64]) {
        rate[0] = 1.0;
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["x > 0"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = y[0];
    }
    fn held(&self, out: &mut [bool]) {
        out[0] = self.positive;
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        let positive = y[0] > 0.0;
        let changed = positive != self.positive;
        self.positive = positive;
        EventChange { changed, ..EventChange::default() }
    }
}

/// Two relations that switch each other at t > 1: the event iteration never settles, unless `size` of what is compared is rounding.
pub(crate) struct Loop {
    pub size: f64,
    pub flip: bool,
    pub late: bool,
}

impl Model for Loop {
    fn names(&self) -> Vec<String> {
        vec!["x".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![0.0]
    }
    fn residual(&self, _t: f64, _y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - 1.0;
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], _state: &mut [f64], rate: &mut [f64]) {
        rate[0] = 1.0;
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["x > 1", "not flip"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = y[0] - 1.0;
        out[1] = if self.flip { self.size } else { -self.size };
    }
    fn held(&self, out: &mut [bool]) {
        (out[0], out[1]) = (self.late, self.flip);
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        self.late = y[0] > 1.0;
        self.flip ^= self.late;
        EventChange { changed: self.late, ..EventChange::default() }
    }
}

/// x' = f(x) for one unknown, by value and slope.
pub(crate) struct Scalar {
    pub start: f64,
    pub value: fn(f64) -> f64,
    pub slope: fn(f64) -> f64,
    pub assertion: fn(f64, f64) -> Option<(&'static str, bool)>,
}

impl Model for Scalar {
    fn names(&self) -> Vec<String> {
        vec!["x".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![self.start]
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - (self.value)(y[0]);
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        (state[0], rate[0]) = (-(self.slope)(y[0]), 1.0);
    }
    fn assertion(&self, t: f64, y: &[f64]) -> Option<(&'static str, bool)> {
        (self.assertion)(t, y[0])
    }
}

/// x' = 1, and `weight * w = 1`, where the weight is 1 until x > 0.5 and `late` after it.
pub(crate) struct Vanishing {
    pub weight: f64,
    pub late: f64,
    above: bool,
}

impl Vanishing {
    pub(crate) fn new(weight: f64, late: f64) -> Self {
        Self { weight, late, above: false }
    }
}

impl Model for Vanishing {
    fn names(&self) -> Vec<String> {
        vec!["x".into(), "w".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![0.0, 1.0]
    }
    fn differential(&self) -> Vec<bool> {
        vec![true, false]
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - 1.0;
        out[1] = self.weight * y[1] - 1.0;
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state[3] = self.weight;
        rate[0] = 1.0;
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["x > 0.5"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = y[0] - 0.5;
    }
    fn held(&self, out: &mut [bool]) {
        out[0] = self.above;
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        let above = y[0] > 0.5;
        let changed = above != self.above;
        self.above = above;
        if above {
            self.weight = self.late;
        }
        EventChange { changed, ..EventChange::default() }
    }
}

/// A tank of level x > 0 with inflow `inflow` and outflow sqrt(x), twice that when the level is above 1 (overflow).
/// The start is the steady state: der(x) = 0, solved for z = (x, der(x)).
pub(crate) struct Tank {
    pub inflow: f64,
    pub guess: f64,
    above: bool,
}

impl Tank {
    pub(crate) fn new(inflow: f64, guess: f64) -> Self {
        Self { inflow, guess, above: false }
    }

    fn factor(&self) -> f64 {
        if self.above { 2.0 } else { 1.0 }
    }
}

impl Model for Tank {
    fn names(&self) -> Vec<String> {
        vec!["x".into(), "q".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![self.guess, 0.0]
    }
    fn differential(&self) -> Vec<bool> {
        vec![true, false]
    }
    fn bind(&mut self) {
        self.above = false;
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - self.inflow + y[1];
        out[1] = y[1] - self.factor() * y[0].sqrt();
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state.copy_from_slice(&[0.0, -0.5 * self.factor() / y[0].sqrt(), 1.0, 1.0]);
        rate[0] = 1.0;
    }
    fn guess(&self) -> Vec<f64> {
        vec![self.guess, 5.0]
    }
    fn initial_residual(&self, z: &[f64], out: &mut [f64]) {
        out[0] = z[1] - self.inflow + self.factor() * z[0].sqrt();
        out[1] = z[1];
    }
    fn initial_jacobian(&self, z: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[0.5 * self.factor() / z[0].sqrt(), 0.0, 1.0, 1.0]);
    }
    fn initial_store(&self, z: &[f64], y: &mut [f64], yp: &mut [f64]) {
        y.copy_from_slice(&[z[0], 0.0]);
        yp.copy_from_slice(&[z[1], 0.0]);
    }
    fn relations(&self) -> Vec<&'static str> {
        vec!["x > 1"]
    }
    fn roots(&self, _t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        out[0] = y[0] - 1.0;
    }
    fn held(&self, out: &mut [bool]) {
        out[0] = self.above;
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, y: &mut [f64], _yp: &[f64]) -> EventChange {
        let above = y[0] > 1.0;
        let changed = above != self.above;
        self.above = above;
        EventChange { changed, ..EventChange::default() }
    }
}

/// Nothing but a discrete count of the seconds.
pub(crate) struct Clock(pub f64);

impl Model for Clock {
    fn names(&self) -> Vec<String> {
        Vec::new()
    }
    fn start(&self) -> Vec<f64> {
        Vec::new()
    }
    fn bind(&mut self) {
        self.0 = 0.0;
    }
    fn residual(&self, _t: f64, _y: &[f64], _yp: &[f64], _out: &mut [f64]) {}
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], _state: &mut [f64], _rate: &mut [f64]) {}
    fn next_time_event(&self, t: f64) -> f64 {
        t.floor() + 1.0
    }
    fn event(&mut self, phase: EventPhase, _t: f64, _y: &mut [f64], _yp: &[f64]) -> EventChange {
        let changed = phase == EventPhase::First;
        self.0 += f64::from(changed);
        EventChange { changed, ..EventChange::default() }
    }
    fn discrete(&self) -> Vec<(&'static str, f64)> {
        vec![("seconds", self.0)]
    }
}
