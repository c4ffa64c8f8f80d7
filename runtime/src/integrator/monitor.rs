//! Which method for what comes next: decided from what steps cost and how far they lead, nothing else.
//!
//! BDF of order 3 and more is unstable close to the imaginary axis (Hairer, Wanner, "Solving Ordinary Differential Equations II"
//! (1996), section V.2): lightly damped oscillations that are not resolved grow until they fill the error estimate, and the step
//! stays where they just do not grow.  The sign: differences no longer fall with the order, `|phi_{k+1}| / |phi_k|` settles near
//! one, while for a resolved solution it is about `h omega`, small.  When the average of this ratio is high the rival is tried:
//! the one-step method, or BDF capped at order 2, which is stable there.  A trial is real steps, so nothing is lost but their
//! difference in cost; the rival stays if time gained per work is clearly better.  The way back is the same trial after a while;
//! trials that fail are repeated at growing distance.  Events do not change the mode.

use hyd_system::math::exp;

/// Weight of the newest step in the average of the ratio.
const NEWEST: f64 = 1.0 / 16.0;
/// Average ratio from which the order is suspected to limit the step.
const SUSPICIOUS: f64 = 0.5;
/// Factor per step by which the longest step is forgotten.
const FADE: f64 = 0.98;
/// Lowest order at which BDF can be unstable.
pub(crate) const LOWEST_UNSTABLE: usize = 3;
/// Share of the past that the meter forgets per unit of work.
const FORGET: f64 = 1.0 / 15.0;
/// A suspicion confirmed, the rival is taken at this gain relative to BDF, whose steps are about to fall; BDF is taken back at
/// this gain relative to the rival.
const RIVAL_AT: f64 = 0.8;
const BDF_AT: f64 = 1.2;
/// After a refused trial the next one is due at once when the gain has fallen by this factor.
const WORSE: f64 = 0.5;
/// Steps before the first suspicion, and in a trial of BDF of all orders.
const PATIENCE: u64 = 30;
const BDF_TRIAL: u64 = 60;
/// Steps before a drop of the gain is believed.
const LEAST_CHANGE: u64 = 10;
/// Steps after which an adopted rival is questioned for the first time; twice as many with each failure of BDF, up to a limit.
const QUESTION: u64 = 20;
const MOST_QUESTION: u64 = 160;
/// Doublings of that where BDF was taken back in vain, up to so many: it did not lead further in the end, or not for so
/// many steps, within which an unresolved oscillation may still be growing.
const MOST_MISLED: u32 = 8;
const LASTING: u64 = 400;
/// Growth of the patience with each refused trial.
const BACKOFF: u64 = 4;

/// What the monitor needs to know of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepFacts {
    /// Size (s).
    pub(crate) h: f64,
    /// Cost, at least 1: iterations, with factorisations counted as several.
    pub(crate) work: f64,
    /// Ratio of the last two differences of BDF.
    pub(crate) ratio: f64,
    /// Order of BDF.
    pub(crate) order: usize,
    /// Attempts were rejected before it.
    pub(crate) rejected: bool,
    /// The next step will be larger.
    pub(crate) growing: bool,
}

/// Who stands against BDF of all orders.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) enum Rival {
    /// The one-step method.
    #[default]
    OneStep,
    /// BDF of at most order 2.
    LowOrder,
}

impl Rival {
    /// Least and most steps of a trial: a BDF formula needs many to grow its step.
    fn trial(self) -> (u64, u64) {
        match self {
            Rival::OneStep => (3, 7),
            Rival::LowOrder => (25, 60),
        }
    }
}

/// The mode in use.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) enum Mode {
    /// BDF of any order.
    #[default]
    Bdf,
    /// The rival on trial.
    RivalTried,
    /// The rival.
    Rival,
    /// BDF of any order on trial again.
    BdfTried,
}

/// Time gained per work, recent steps counting most.
#[derive(Clone, Copy, Default, Debug, serde::Serialize, serde::Deserialize)]
struct Meter {
    time: f64,
    work: f64,
    /// The work of the last step and what it leaves of the past: most steps cost as much as the one before.
    kept: (f64, f64),
}

impl Meter {
    fn add(&mut self, facts: &StepFacts) {
        if facts.work != self.kept.0 {
            self.kept = (facts.work, exp(-FORGET * facts.work));
        }
        let keep = self.kept.1;
        self.time = keep * self.time + facts.h;
        self.work = keep * self.work + facts.work;
    }

    fn gain(&self) -> f64 {
        if self.work > 0.0 { self.time / self.work } else { 0.0 }
    }
}

/// BDF since it was taken back from the rival.
#[derive(Clone, Copy, Default, Debug, serde::Serialize, serde::Deserialize)]
struct Return {
    /// Gain of the rival then.
    left: f64,
    /// Time (s) and work since, nothing forgotten.
    time: f64,
    work: f64,
    steps: u64,
}

impl Return {
    /// BDF led clearly further than the rival had done before, and not only for a while.
    fn was_right(&self) -> bool {
        self.steps >= LASTING && self.time > BDF_AT * self.left * self.work
    }
}

/// Memory of the decisions of a run.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Monitor {
    mode: Mode,
    rival: Rival,
    recent: Meter,
    ratio: f64,
    steps: u64,
    /// Gain of the mode before the trial; that of BDF when the rival was last refused.
    before: f64,
    refused: f64,
    advantage: f64,
    /// Longest of the last steps (s), those long ago counting less.
    longest: f64,
    patience: u64,
    question: u64,
    back: Option<Return>,
    /// How often in a row BDF was taken back in vain.
    misled: u32,
}

impl Monitor {
    /// A monitor at the start of a run.
    pub(crate) fn new(rival: Rival) -> Self {
        Self {
            mode: Mode::Bdf,
            rival,
            recent: Meter::default(),
            ratio: 0.0,
            steps: 0,
            before: 0.0,
            refused: 0.0,
            advantage: 1.0,
            longest: 0.0,
            patience: PATIENCE,
            question: QUESTION,
            back: None,
            misled: 0,
        }
    }

    /// The mode for the next step.
    pub(crate) fn mode(&self) -> Mode {
        self.mode
    }

    /// After an event: averages begin anew, a trial ends without verdict.
    pub(crate) fn restart(&mut self) {
        self.mode = match self.mode {
            Mode::RivalTried | Mode::Bdf => Mode::Bdf,
            Mode::BdfTried | Mode::Rival => Mode::Rival,
        };
        self.recent = Meter::default();
        self.ratio = 0.0;
        self.steps = 0;
        (self.refused, self.longest) = (0.0, 0.0);
        self.back = None;
    }

    /// Longest of the last steps (s), those long ago counting less.
    pub(crate) fn longest(&self) -> f64 {
        self.longest
    }

    /// Gain of the mode on trial over that before.
    pub(crate) fn advantage(&self) -> f64 {
        self.advantage
    }

    /// Takes in an accepted step; true if the mode has changed.
    pub(crate) fn after(&mut self, facts: &StepFacts) -> bool {
        self.steps += 1;
        self.longest = facts.h.max(FADE * self.longest);
        self.recent.add(facts);
        if let Some(back) = self.back.as_mut().filter(|_| self.mode == Mode::Bdf) {
            (back.time, back.work, back.steps) = (back.time + facts.h, back.work + facts.work, back.steps + 1);
        }
        let next = match self.mode {
            Mode::Bdf => self.suspicion(facts),
            Mode::RivalTried => self.rival_verdict(facts),
            Mode::Rival if self.steps >= self.question => Mode::BdfTried,
            Mode::Rival => Mode::Rival,
            Mode::BdfTried => self.bdf_verdict(facts),
        };
        self.advantage = if self.before > 0.0 { self.recent.gain() / self.before } else { 1.0 };
        let changed = next != self.mode;
        if changed {
            self.enter(next);
        }
        changed
    }

    fn average(&mut self, facts: &StepFacts) -> bool {
        if facts.rejected || facts.order < LOWEST_UNSTABLE {
            // A bend in the solution, not a slow growth.
            self.ratio = 0.0;
            return false;
        }
        let ratio = facts.ratio.min(1.0);
        self.ratio += NEWEST * (ratio - self.ratio);
        self.ratio > SUSPICIOUS
    }

    fn suspicion(&mut self, facts: &StepFacts) -> Mode {
        let suspicious = self.average(facts);
        let worse = self.steps >= LEAST_CHANGE && self.recent.gain() < WORSE * self.refused;
        if suspicious && (self.steps >= self.patience || worse) { Mode::RivalTried } else { Mode::Bdf }
    }

    fn rival_verdict(&mut self, facts: &StepFacts) -> Mode {
        let gain = self.recent.gain();
        let (least, most) = self.rival.trial();
        if self.steps >= least && gain > RIVAL_AT * self.before {
            if let Some(back) = self.back.take() {
                self.misled = if back.was_right() { 0 } else { (self.misled + 1).min(MOST_MISLED) };
            }
            self.question = QUESTION << self.misled;
            return Mode::Rival;
        }
        let hopeless = self.steps >= least && !facts.growing && gain < RIVAL_AT * self.before;
        if hopeless || self.steps >= most {
            self.refused = self.before;
            self.patience = (BACKOFF * self.patience).min(1 << 20);
            return Mode::Bdf;
        }
        Mode::RivalTried
    }

    fn bdf_verdict(&mut self, facts: &StepFacts) -> Mode {
        let suspicious = self.average(facts);
        let gain = self.recent.gain();
        if self.steps >= PATIENCE && suspicious && self.recent.gain() < BDF_AT * self.before {
            self.question = self.longer();
            return Mode::Rival;
        }
        if self.steps < BDF_TRIAL {
            return Mode::BdfTried;
        }
        if gain > BDF_AT * self.before {
            self.patience = PATIENCE;
            self.back = Some(Return { left: self.before, ..Return::default() });
            return Mode::Bdf;
        }
        self.question = self.longer();
        Mode::Rival
    }

    fn longer(&self) -> u64 {
        (2 * self.question).min(MOST_QUESTION << self.misled)
    }

    fn enter(&mut self, next: Mode) {
        let trial = matches!(next, Mode::RivalTried | Mode::BdfTried);
        if trial {
            self.before = self.recent.gain();
        }
        self.recent = Meter::default();
        self.mode = next;
        self.steps = 0;
        self.ratio = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::{Mode, Monitor, Rival, StepFacts};

    /// Steps of both methods among `count`, where BDF leads twice as far as the rival for `good` steps after each
    /// handover, and a tenth as far from then on.
    fn shares(good: u64, count: u64) -> (u64, u64) {
        let mut monitor = Monitor::new(Rival::OneStep);
        let (mut bdf, mut rival, mut since) = (0, 0, u64::MAX / 2);
        for _ in 0..count {
            let is_rival = matches!(monitor.mode(), Mode::Rival | Mode::RivalTried);
            let fine = since < good;
            let (h, ratio) = match (is_rival, fine) {
                (true, _) => (1.0, 0.0),
                (false, true) => (2.0, 0.1),
                (false, false) => (0.1, 0.9),
            };
            *(if is_rival { &mut rival } else { &mut bdf }) += 1;
            since = if is_rival { 0 } else { since.saturating_add(1) };
            monitor.after(&StepFacts { h, work: 1.0, ratio, order: 5, rejected: false, growing: true });
        }
        (bdf, rival)
    }

    /// What looks good for a hundred steps after each handover is believed ever less often; what lasts is believed at once.
    #[test]
    fn a_return_in_vain_is_tried_ever_less_often() {
        let (bdf, rival) = shares(100, 50_000);
        assert!(bdf < rival / 8, "{bdf} steps of BDF, {rival} of the rival");
        let (bdf, rival) = shares(u64::MAX / 4, 50_000);
        assert!(rival < 200, "{bdf} steps of BDF, {rival} of the rival");
    }
}
