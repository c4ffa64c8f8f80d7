//! What a search has left open, and the models by which a further shot is judged.

use super::evidence::{Change, Known, Share};
use super::planned::carried;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::power::CLEAR;
use crate::evidence::thresholds::NEEDED;
use crate::fit::Fit;
use crate::problem::{Problem, Weighing};
use crate::search::{Findings, Pass, Status, Tried};
use crate::variant::Workshop;
use crate::{Fault, Setup};
use nalgebra::DVector;

/// Most rivals that are told apart at once: each is run at every point, and compared with each other one.
const MOST_RIVALS: usize = 4;
/// Evidence at which a shot has shown about all that it can.
const ENOUGH: f64 = 50.0;
/// A rival's cost lies above the lowest by less than this, or this part of what the best has explained.
const NEAR: (f64, f64) = (60.0, 0.05);

/// What is to be learned.
pub(crate) enum Aim {
    /// Which of several models is right.
    Apart,
    /// Whether an effect is there that could hide so far.
    Reveal {
        /// By effect what the shots that were made say of one of typical size: the square and the pull.
        before: Vec<Change>,
    },
    /// How large effects are: positions of their sizes among the unknowns of all shots.
    Narrow {
        /// These positions.
        sizes: Vec<usize>,
    },
}

/// A model by which shots are judged.
pub(crate) struct Contender {
    /// What it is called.
    pub label: String,
    /// The model with the inputs of planned shots.
    pub hypothesis: Hypothesis,
    /// Its fit to the shots that were made; of one that is only looked at, the unknowns.
    pub fit: Fit,
    /// What these shots know of it; none for one that is only looked at.
    pub known: Option<Known>,
    /// The same model with the inputs of the shots that were made.
    pub made: Hypothesis,
    /// The typical size of an effect that is only looked at.
    pub size: Option<f64>,
}

/// What a search leaves open.
pub(crate) enum Open {
    /// This.
    Question(Question),
    /// Nothing that a further shot could settle, and why.
    Nothing(&'static str),
}

/// What is to be learned, by which models.
pub(crate) struct Question {
    /// What.
    pub aim: Aim,
    /// By which models; the first is the one whose records are taken for the truth where one is needed.
    pub contenders: Vec<Contender>,
    /// How many there would have been.
    pub all: usize,
    /// Names of the sizes that are to be narrowed.
    pub sizes: Vec<String>,
    /// Pairs that no shot of the ranges tells apart: whose record, and which model.
    pub hopeless: Vec<(usize, usize)>,
    /// Effects that the shots that were made cannot be run with at their typical size.
    pub unrun: Vec<String>,
}

impl Question {
    /// Contenders that are called alike get the places that tell them apart.
    fn new(aim: Aim, mut contenders: Vec<Contender>, all: usize) -> Self {
        let labels: Vec<String> = contenders.iter().map(|own| own.label.clone()).collect();
        for own in &mut contenders {
            if labels.iter().filter(|label| **label == own.label).count() > 1 {
                own.label = own.made.key();
            }
        }
        Self { aim, contenders, all, sizes: Vec::new(), hopeless: Vec::new(), unrun: Vec::new() }
    }

    /// What the findings leave open.
    ///
    /// # Errors
    /// A text that cannot be translated.
    pub(crate) fn of(
        (setup, planned): (&Setup, &Setup),
        workshop: &Workshop<'_>,
        findings: &Findings,
    ) -> Result<Open, Fault> {
        let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else {
            return Err(Fault::run("nothing was fitted"));
        };
        let make = Make { setup, planned, workshop };
        match findings.status {
            _ if findings.ambiguous.len() > 1 => {
                let is_rival =
                    |tried: &&Tried| findings.ambiguous.iter().any(|candidate| tried.hypothesis.ends_with(candidate));
                make.apart(last.tried.iter().filter(is_rival).collect())
            }
            Status::Adequate => make.reveal(first),
            Status::Named | Status::Sensor | Status::Law => make.narrow(last),
            Status::Ambiguous | Status::Unknown | Status::Unconverged => make.apart(near(last)),
        }
    }

    /// Number of rivals with whose records a contender is compared.
    pub(crate) fn rivals(&self, contender: usize) -> usize {
        match self.aim {
            Aim::Apart => self.contenders.len(),
            Aim::Reveal { .. } if contender == 0 => self.contenders.len(),
            _ => 0,
        }
    }

    /// What planned shots bring, by what all together say: larger is better.  Of pairs that are told apart as surely as can be no more is
    /// wanted, so that the others count.
    pub(crate) fn worth(&self, shares: &[Share]) -> f64 {
        let saturated = |evidence: f64, enough: f64| 1.0 - hyd_system::math::exp(-evidence / enough);
        match &self.aim {
            Aim::Apart | Aim::Reveal { .. } => {
                let enough = if matches!(self.aim, Aim::Apart) { ENOUGH } else { CLEAR };
                let decided = |(truth, model): (usize, usize)| saturated(self.evidence(shares, truth, model), enough);
                self.compared().into_iter().map(decided).sum()
            }
            Aim::Narrow { sizes } => {
                let narrowing = (0..sizes.len()).map(|own| self.narrowing(shares, own));
                -hyd_system::math::ln(narrowing.fold(0.0, f64::max).max(f64::MIN_POSITIVE))
            }
        }
    }

    /// By how much the cost of a model's best fit is expected to grow where the record is another one's.
    pub(crate) fn evidence(&self, shares: &[Share], truth: usize, model: usize) -> f64 {
        let Some(known) = &self.contenders[model].known else { return 0.0 };
        match &self.aim {
            Aim::Reveal { before } => {
                let mut whole = shares[model].clone();
                whole.against[truth].0 += before[truth].0;
                whole.against[truth].1 += &before[truth].1;
                whole.growth(&known.information, truth).map_or(0.0, |(growth, _)| growth)
            }
            _ => shares[model].growth(&known.information, truth).map_or(0.0, |(growth, _)| growth),
        }
    }

    /// By which factor the interval of a size gets narrower.
    pub(crate) fn narrowing(&self, shares: &[Share], size: usize) -> f64 {
        let (Aim::Narrow { sizes }, Some(known)) = (&self.aim, &self.contenders[0].known) else { return 1.0 };
        shares[0].narrowing(&known.information, sizes[size]).unwrap_or(1.0)
    }
}

/// Candidates and terms of a pass that explain about as much as the best.
fn near(pass: &Pass) -> Vec<&Tried> {
    let fitted = || pass.tried.iter().chain(&pass.terms).filter_map(|tried| Some((tried, tried.fit.as_ref()?)));
    let lowest = fitted().map(|(_, fit)| fit.cost).fold(f64::INFINITY, f64::min);
    let close = NEAR.0.max(NEAR.1 * (pass.fit.cost - lowest));
    let is_near = |(tried, fit): &(&Tried, &Fit)| {
        let scale = (fit.misfit / pass.expected).max(1.0);
        fit.cost - lowest < close * scale && tried.cost_drop >= NEEDED
    };
    fitted().filter(is_near).map(|(tried, _)| tried).collect()
}

/// Makes contenders.
struct Make<'a> {
    setup: &'a Setup,
    planned: &'a Setup,
    workshop: &'a Workshop<'a>,
}

impl Make<'_> {
    /// A model, once with the inputs of the shots that were made and once with those of planned ones.
    fn both(&self, of: &Hypothesis) -> Result<(Hypothesis, Hypothesis), Fault> {
        let made = |setup| Hypothesis::with_terms(setup, self.workshop, of.inserts.clone(), of.terms.clone());
        Ok((made(self.planned)?, made(self.setup)?))
    }

    fn whole(&self) -> Weighing {
        Weighing::whole(&self.setup.train, self.setup.study.shots.time_tolerance)
    }

    /// A model with its fit.
    fn fitted(&self, of: &Hypothesis, fit: &Fit, label: String) -> Result<Contender, Fault> {
        let (hypothesis, made) = self.both(of)?;
        let mut fit = fit.clone();
        made.refresh(self.setup, &mut fit, &self.whole())?;
        let problem = made.problem(self.setup)?;
        let known = fit.jacobian.as_ref().and_then(|jacobian| Known::of(jacobian, &problem.unknowns));
        drop(problem);
        if known.is_none() {
            return Err(Fault::run(format!("what the shots know of {label} is not finite")));
        }
        Ok(Contender { label, hypothesis, fit, known, made, size: None })
    }

    fn apart(&self, mut rivals: Vec<&Tried>) -> Result<Open, Fault> {
        let cost = |tried: &Tried| tried.fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
        rivals.retain(|tried| tried.fit.is_some());
        rivals.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        let all = rivals.len();
        if all < 2 {
            return Ok(Open::Nothing(
                "nothing that a further shot could tell apart: no two effects or terms explain what is left about equally well; an \
                 effect written for it can be tried (`hyd discover --library`)",
            ));
        }
        rivals.truncate(MOST_RIVALS);
        let contender = |tried: &&Tried| match &tried.fit {
            Some(fit) => self.fitted(&tried.hypothesis, fit, tried.hypothesis.own_label()),
            None => Err(Fault::run("a rival without a fit")),
        };
        let contenders = rivals.iter().map(contender).collect::<Result<_, _>>()?;
        Ok(Open::Question(Question::new(Aim::Apart, contenders, all)))
    }

    /// Effects of typical size that the shots could not show for certain.
    fn reveal(&self, pass: &Pass) -> Result<Open, Fault> {
        let base = self.fitted(&pass.base, &pass.fit, "the base model".to_string())?;
        let whole = self.whole();
        let (mut before, mut contenders) = (vec![(0.0, DVector::zeros(0))], vec![base]);
        let (mut all, mut unrun) = (0, Vec::new());
        for tried in &pass.tried {
            let Some(candidate) = tried.hypothesis.inserts.last() else { continue };
            let problem = tried.hypothesis.problem(self.setup)?;
            let typical = candidate.effect.probe * self.setup.scale(candidate);
            let xi = tried.hypothesis.at_size(&problem, &pass.fit.xi, typical);
            let Ok(fit) = Fit::at(&problem, &xi, &whole) else {
                unrun.push(tried.hypothesis.own_label());
                continue;
            };
            // The residuals of the base model where the record has the effect, less those where it has not.
            let change = &contenders[0].fit.residuals - &fit.residuals;
            let Some(known) = &contenders[0].known else { continue };
            let seen = known.change(&change);
            let alone = Share { against: vec![seen.clone()], ..Share::none(seen.1.len(), 0) };
            let visible = alone.growth(&known.information, 0).map_or(0.0, |(growth, _)| growth);
            if visible >= CLEAR {
                continue;
            }
            all += 1;
            drop(problem);
            let (hypothesis, made) = self.both(&tried.hypothesis)?;
            let (label, size) = (tried.hypothesis.own_label(), Some(typical));
            contenders.push(Contender { label, hypothesis, fit, known: None, made, size });
            before.push(seen);
        }
        if all == 0 {
            return Ok(Open::Nothing(
                "nothing could have hidden: every effect of the libraries that fits this model would have been seen at its typical size",
            ));
        }
        before[0].1 = DVector::zeros(before[1].1.len());
        let question = Question::new(Aim::Reveal { before }, contenders, all);
        Ok(Open::Question(Question { unrun, ..question }))
    }

    fn narrow(&self, pass: &Pass) -> Result<Open, Fault> {
        let own = self.fitted(&pass.base, &pass.fit, pass.base.label())?;
        let problem = own.made.problem(self.setup)?;
        let common = own.known.as_ref().map_or(&[][..], |known| &known.common);
        let is_size = |unknown: usize| {
            problem.unknowns[unknown]
                .effect
                .is_some_and(|part| part.parameter == 0 && part.effect < own.made.inserts.len())
        };
        let sizes: Vec<usize> = (0..common.len()).filter(|&place| is_size(common[place])).collect();
        let names = sizes.iter().map(|&place| problem.unknowns[common[place]].name.clone()).collect();
        drop(problem);
        if sizes.is_empty() {
            return Ok(Open::Nothing(
                "the size of what was found is another one in every shot, so that no further shot makes it better known",
            ));
        }
        let question = Question::new(Aim::Narrow { sizes }, vec![own], 1);
        Ok(Open::Question(Question { sizes: names, ..question }))
    }
}

impl Contender {
    /// Its unknowns for shots that are planned.
    pub(crate) fn unknowns(&self, setup: &Setup, to: &Problem<'_>) -> Result<Vec<f64>, Fault> {
        Ok(carried(&self.made.problem(setup)?, &self.fit.xi, to))
    }
}
