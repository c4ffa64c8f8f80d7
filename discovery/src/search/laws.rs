//! A law where no effect is known: terms of one equation, grown one by one as long as each is needed, and judged like an effect.
//!
//! Where a search ends with something unknown, the terms that were fitted are gone on with: all terms of the same equation are compared
//! with what is left, the best is fitted beside those before, and stays if the cost falls by what a name needs and by the price of the
//! choice.  The largest of `n` scores that chance alone makes is about `2 ln n` (each is a chi-squared variable of one degree of freedom;
//! Foster, George, "The risk inflation criterion for multiple regression", Annals of Statistics 22 (1994) 1947), so that is what a term
//! chosen among `n` pays.  A law needs what a name needs: what is left is noise, every coefficient is four standard errors from
//! nothing, no effect explains as much and no law of another equation, and shots held out do not refute it.  Where no terms explain it,
//! forms with memory are tried ([`super::lasting`]).

use hyd_system::math;

use super::Start;
use super::context::{Search, patience};
use super::pass::{Findings, Pass, Status, Tried, by_cost};
use super::rule;
use crate::catalogue::Site;
use crate::catalogue::door::Door;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::location::{Located, locate};
use crate::evidence::projection::Projection;
use crate::evidence::thresholds::{ERRORS, LEAD, adequate};
use crate::fault::Fault;
use crate::fit::{Fit, minimise};
use crate::terms::dictionary::Term;
use crate::terms::law::{self, Law, LawTerm, Parts, Rival};

/// Most terms of a law.
const MOST_TERMS: usize = 3;
/// Terms of one equation that are fitted before one is chosen.
const FITTED: usize = 3;
/// Equations whose laws are grown.
const EQUATIONS: usize = 3;
/// Spread of a coefficient before the measurement, by what its screening claims.
const SPREAD: f64 = 5.0;

/// A law in the making.
pub(super) struct Grown {
    pub hypothesis: Hypothesis,
    pub fit: Fit,
    /// The drop of the cost that it needs.
    pub needed: f64,
}

/// Why there is no law.
pub(super) enum NoLaw {
    /// Nothing explains anything.
    Nothing,
    /// For this reason; another form may be one.
    Because(String),
    /// For this reason, whatever other forms say.
    Ever(String),
}

impl Search<'_> {
    /// Findings that [may have one](Search::may_have_law) with a law in place of something unknown, where one explains it; or in place of
    /// names that each explain a part only, where it explains more than they do together.
    ///
    /// # Errors
    /// A model that cannot be translated or run.
    pub(super) fn with_law(&self, mut findings: Findings) -> Result<Findings, Fault> {
        let named = findings.passes.last().filter(|_| findings.status == Status::Named);
        let most = named.map_or(f64::INFINITY, |last| last.fit.cost);
        // What a law explains is what the model lacks as it came.
        let later = findings.passes.split_off(1);
        let is_alone = later.is_empty();
        let Some(first) = findings.passes.last_mut() else { return Ok(findings) };
        if first.located.is_empty() && is_alone {
            // Little seemed to be missing as long as a nuisance was far off, or as model error was taken for granted.
            self.look_at_equations(first)?;
            self.fit_terms(first)?;
            self.judge(first);
        }
        let (status, expected) = (findings.status, first.expected);
        let found = self.law_of(first, findings.hidden)?;
        let is_more = |found: &(Law, Grown)| {
            let scale = (found.1.fit.misfit / expected).max(1.0);
            price(found) + LEAD * scale <= most
        };
        match found {
            Ok(found) if is_more(&found) => {
                (self.progress)(&format!("a law: {}", found.0.equation()));
                findings = self.proved(findings, found.0, &found.1)?;
            }
            Ok(_) => {}
            Err(why) => findings.no_law = why,
        }
        if findings.status != Status::Law {
            findings.passes.extend(later);
            findings.no_law = findings.no_law.filter(|_| status == Status::Unknown);
        }
        Ok(findings)
    }

    /// True where something is unknown, or names each explain a part only.
    pub(super) fn may_have_law(findings: &Findings) -> bool {
        match findings.status {
            Status::Unknown => !findings.passes.is_empty(),
            Status::Named => is_pieced(findings),
            _ => false,
        }
    }

    /// The law that explains what a pass leaves, or why there is none; without a reason where nothing explains anything.
    fn law_of(&self, last: &Pass, hidden: bool) -> Result<Result<(Law, Grown), Option<String>>, Fault> {
        let none = |why: &str| Ok(Err(Some(why.to_string())));
        if self.setup.held_out.is_empty() {
            return none("no shot is held out on which it could be proved");
        }
        if !self.setup.has_several_operating_points() {
            return none("all shots were made at one operating point, where wrong numbers and laws look alike");
        }
        // A form that was chosen by the data and leaves model error is not the law.
        if hidden || !self.setup.disturbances.is_noise() {
            return none("every model leaves more than noise, and a form that the data chose would imitate that");
        }
        let places = self.workshop.places()?;
        let declared: Vec<&Site> = places.iter().filter(|site| site.door == Door::Component).collect();
        let of_terms = match self.law_of_terms(last, &declared)? {
            // One term that leaves noise is as plain as can be.
            Ok((law, grown)) if law.terms.len() == 1 => return Ok(Ok((law, grown))),
            Err(NoLaw::Ever(why)) => return Ok(Err(Some(why))),
            of_terms => of_terms,
        };
        let with_memory = self.law_with_memory(last, &declared)?;
        Ok(match (of_terms, with_memory) {
            (Ok(one), Ok(other)) => {
                let behind = (price(&other) - price(&one)) / (one.1.fit.misfit / last.expected).max(1.0);
                match behind {
                    behind if behind >= LEAD => Ok(one),
                    behind if behind <= -LEAD => Ok(other),
                    _ => {
                        let (one, other) = (one.0.equation(), other.0.equation());
                        Err(Some(format!("`{one}` would be one, and `{other}` explains it as well")))
                    }
                }
            }
            (Ok(law), Err(_)) | (Err(_), Ok(law)) => Ok(law),
            (Err(_), Err(NoLaw::Because(why) | NoLaw::Ever(why))) | (Err(NoLaw::Because(why)), Err(NoLaw::Nothing)) => {
                Err(Some(why))
            }
            (Err(_), Err(NoLaw::Nothing)) => Err(None),
        })
    }

    /// The law that the terms of a pass grow into.
    fn law_of_terms(&self, last: &Pass, declared: &[&Site]) -> Result<Result<(Law, Grown), NoLaw>, Fault> {
        let drop = |fit: &Fit| (last.fit.cost - fit.cost) / (fit.misfit / last.expected).max(1.0);
        let explains = |tried: &Tried| tried.fit.as_ref().is_some_and(|fit| drop(fit) >= self.needed);
        if !last.terms.iter().any(explains) {
            return Ok(Err(NoLaw::Nothing));
        }
        let none = |why: &str| Ok(Err(NoLaw::Because(why.to_string())));
        let mut grown: Vec<Grown> = Vec::new();
        for k in by_cost(&last.terms).into_iter().take(EQUATIONS) {
            let tried = &last.terms[k];
            let [(term, _)] = &tried.hypothesis.terms[..] else { continue };
            if explains(tried) && self.is_writable(term, declared) {
                grown.extend(self.grow(last, tried, declared)?);
            }
        }
        if grown.is_empty() {
            return none(
                "the equations whose terms explain it are those of a library, or of components that the model does not declare as places",
            );
        }
        grown.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let Some(best) = grown.iter().position(|own| self.is_sound(last, own)) else {
            return none("no terms of one equation leave noise with coefficients that are known");
        };
        let scale = (grown[best].fit.misfit / last.expected).max(1.0);
        let lead = |fit: &Fit| (fit.cost - grown[best].fit.cost) / scale;
        let rivals = rivals(last, &grown, best, &lead);
        if let Some(rival) = rivals.iter().find(|rival| rival.behind < LEAD) {
            let words =
                format!("{} would be one, and {} explains it as well", said(&grown[best].hypothesis), rival.said());
            return Ok(Err(NoLaw::Ever(words)));
        }
        let Some(mut law) = self.written(&grown[best], declared)? else {
            return none("its equation cannot be written as a class of its own");
        };
        law.rivals = rivals;
        law.rivals.truncate(law::RIVALS);
        Ok(Ok((law, grown.swap_remove(best))))
    }

    /// The search gone on with a law in the model; the findings as they were where the law does not hold.
    fn proved(&self, mut findings: Findings, law: Law, grown: &Grown) -> Result<Findings, Fault> {
        let found = vec![law.candidate.clone()];
        let known = findings.passes.len();
        let again = law.known_to(self.workshop, |workshop| -> Result<Option<Findings>, Fault> {
            let search = Search { workshop, ..self.again() };
            let Some(fit) = search.as_text(&law, grown)? else { return Ok(None) };
            let passes = std::mem::take(&mut findings.passes);
            search.from(passes, found.clone(), Start::Fit(Box::new(fit))).map(Some)
        })?;
        let Some(mut again) = again else {
            findings.no_law = Some(format!("the text of `{}` does not mean what was fitted", law.equation()));
            return Ok(findings);
        };
        again.keep_refuted(&findings.refuted);
        let last = again.passes.last().filter(|_| again.status == Status::Named);
        match last.map(|last| self.hides(last)).transpose()? {
            Some(false) => {
                (again.status, again.law) = (Status::Law, Some(law));
                return Ok(again);
            }
            // A form that the data chose fits what it was chosen by: scatter from shot to shot, for one.
            Some(true) => again.reason = Some("the shots held out show a gap that it does not explain".to_string()),
            None => {}
        }
        again.passes.truncate(known);
        findings.passes = again.passes;
        let why = again.reason.unwrap_or_else(|| format!("with it the answer is {}", again.status.word()));
        findings.no_law = Some(format!("`{}` does not hold: {why}", law.equation()));
        Ok(findings)
    }

    /// The fit of a law as its text says it; none where the text does not mean what was found.
    fn as_text(&self, law: &Law, grown: &Grown) -> Result<Option<Fit>, Fault> {
        let Ok(hypothesis) = Hypothesis::new(self.setup, self.workshop, vec![law.candidate.clone()]) else {
            return Ok(None);
        };
        let problem = hypothesis.problem(self.setup)?;
        if problem.unknowns.len() != grown.fit.xi.len() {
            return Ok(None);
        }
        let Ok(same) = Fit::at(&problem, &grown.fit.xi, &self.whole()) else { return Ok(None) };
        if (same.cost - grown.fit.cost).abs() >= LEAD {
            return Ok(None);
        }
        Ok(minimise(&problem, &grown.fit.xi, &self.whole(), patience(&problem), None).ok())
    }

    /// True if a law at this equation can be written as text.
    pub(super) fn is_writable(&self, term: &Term, declared: &[&Site]) -> bool {
        // Of a package that says where effects have places, laws are written there only.
        let is_own = match !self.workshop.preamble.is_empty() && *term.file == *self.workshop.name() {
            true => true,
            false => declared.is_empty() && self.workshop.own_text(&term.file).is_some(),
        };
        is_own || declared.iter().any(|site| site.path == *term.component)
    }

    /// Every coefficient is known, and what is left is noise.
    fn is_sound(&self, pass: &Pass, own: &Grown) -> bool {
        let Ok(problem) = own.hypothesis.problem(self.setup) else { return false };
        let first = problem.unknowns.len() - own.hypothesis.terms.len();
        let is_known = |k: usize| own.fit.standard_error(k).is_some_and(|error| own.fit.xi[k].abs() >= ERRORS * error);
        let drop = (pass.fit.cost - own.fit.cost) / (own.fit.misfit / pass.expected).max(1.0);
        own.fit.misfit <= adequate(pass.expected) && drop >= own.needed && (first..problem.unknowns.len()).all(is_known)
    }

    /// Adds terms of the same equation as long as each is needed.
    fn grow(&self, pass: &Pass, tried: &Tried, declared: &[&Site]) -> Result<Option<Grown>, Fault> {
        let Some(fit) = &tried.fit else { return Ok(None) };
        let price = |count: usize| self.needed + 2.0 * math::ln(count.max(1) as f64);
        let hypothesis = Hypothesis::with_terms(self.setup, self.workshop, Vec::new(), tried.hypothesis.terms.clone())?;
        let mut own = Grown { hypothesis, fit: fit.clone(), needed: price(pass.located.len()) };
        own.hypothesis.refresh(self.setup, &mut own.fit, &self.whole())?;
        while own.hypothesis.terms.len() < MOST_TERMS && own.fit.misfit > adequate(pass.expected) {
            let Some(projection) = Projection::new(&own.fit) else { break };
            let paths: Vec<&str> = declared.iter().map(|site| site.path.as_str()).collect();
            let at = own.hypothesis.terms.first().map(|(term, _)| term);
            let fitted = (&own.fit, &projection);
            let located =
                locate((self.setup, self.workshop, self.tasks), &own.hypothesis, (&paths, at), fitted, &self.whole())?;
            drop(projection);
            let least = price(located.len());
            let likely = located.iter().filter(|own| own.score.gain >= self.needed).take(FITTED);
            let mut best: Option<Grown> = None;
            for next in likely {
                if let Some(more) = self.with_term(&own, next, least)?
                    && best.as_ref().is_none_or(|best| more.fit.cost < best.fit.cost)
                {
                    best = Some(more);
                }
            }
            let is_needed =
                |more: &Grown| own.fit.cost - more.fit.cost >= least * (more.fit.misfit / pass.expected).max(1.0);
            match best.filter(is_needed) {
                Some(more) => own = more,
                None => break,
            }
        }
        Ok(Some(own))
    }

    /// A law with one more term, fitted.
    fn with_term(&self, own: &Grown, next: &Located, least: f64) -> Result<Option<Grown>, Fault> {
        (self.progress)(&format!("fitting {} beside {}", next.term.shape, own.hypothesis.own_label()));
        let spread = SPREAD * next.score.amplitude.abs();
        let mut terms = own.hypothesis.terms.clone();
        terms.push((next.term.clone(), spread));
        let Ok(hypothesis) = Hypothesis::with_terms(self.setup, self.workshop, Vec::new(), terms) else {
            return Ok(None);
        };
        let make = || {
            let problem = hypothesis.problem(self.setup)?;
            let start = hypothesis.at_size(&problem, &own.fit.xi, next.score.amplitude);
            Ok(minimise(&problem, &start, &self.whole(), patience(&problem), None).ok())
        };
        let task = || self.task("with a term", &hypothesis, &[&own.fit.xi, &[next.score.amplitude]]);
        let Some(fit) = self.one(task, make)? else { return Ok(None) };
        let mut more = Grown { hypothesis, fit, needed: own.needed + least };
        more.hypothesis.refresh(self.setup, &mut more.fit, &self.whole())?;
        Ok(Some(more))
    }

    /// The text of a law.
    fn written(&self, own: &Grown, declared: &[&Site]) -> Result<Option<Law>, Fault> {
        let count = own.hypothesis.problem(self.setup)?.unknowns.len() - own.hypothesis.terms.len();
        let term = |(k, (term, spread)): (usize, &(Term, f64))| LawTerm {
            term: term.clone(),
            value: own.fit.xi[count + k] * spread,
            error: own.fit.standard_error(count + k).map_or(f64::NAN, |error| error * spread),
            spread: *spread,
        };
        let terms: Vec<LawTerm> = own.hypothesis.terms.iter().enumerate().map(term).collect();
        self.as_law(declared, Parts { terms, memory: None })
    }

    /// The text of what a law consists of; none where it cannot be written.
    pub(super) fn as_law(&self, declared: &[&Site], parts: Parts<'_>) -> Result<Option<Law>, Fault> {
        let ids: Vec<&str> = self.candidates.iter().map(|own| &*own.effect.id).collect();
        let files = self.workshop.files(&[])?;
        Ok(Law::new(self.workshop, (declared, &ids), &files, parts))
    }
}

/// True if the first of several names left a part of what was missing that counts.
fn is_pieced(findings: &Findings) -> bool {
    let [first, second, ..] = &findings.passes[..] else { return false };
    rule::is_pieced((first.fit.misfit, second.fit.misfit), (first.expected, adequate(first.expected)))
}

/// The cost of a law with what its choice among so many costs.
fn price((_, grown): &(Law, Grown)) -> f64 {
    grown.fit.cost + grown.needed
}

/// True if a term belongs to the equation of a law.
fn is_at(tried: &Tried, own: &Grown) -> bool {
    let place =
        |terms: &[(Term, f64)]| terms.first().map(|(term, _)| (term.component.clone(), term.file.clone(), term.line));
    place(&tried.hypothesis.terms) == place(&own.hypothesis.terms)
}

/// The terms of a hypothesis and their equation, for messages.
fn said(hypothesis: &Hypothesis) -> String {
    let shapes: Vec<&str> = hypothesis.terms.iter().map(|(term, _)| term.shape.as_str()).collect();
    let equation = hypothesis.terms.first().map_or("", |(term, _)| term.equation.trim_end_matches(';'));
    format!("{} in `{equation}`", shapes.join(" + "))
}

/// What else was fitted, the best first.
fn rivals(pass: &Pass, grown: &[Grown], best: usize, lead: &dyn Fn(&Fit) -> f64) -> Vec<Rival> {
    let of = |terms: &[(Term, f64)], fit: &Fit| {
        let shapes: Vec<&str> = terms.iter().map(|(term, _)| term.shape.as_str()).collect();
        let equation = terms.first().map_or(String::new(), |(term, _)| term.equation.clone());
        Rival { equation, shape: shapes.join(" + "), behind: lead(fit) }
    };
    let laws = grown.iter().enumerate().filter(|(k, _)| *k != best).map(|(_, own)| of(&own.hypothesis.terms, &own.fit));
    // What a law was grown from is no rival of it.
    let is_grown = |tried: &&Tried| grown.iter().any(|own| is_at(tried, own));
    let terms = pass.terms.iter().filter(|tried| !is_grown(tried));
    let terms = terms.filter_map(|tried| Some(of(&tried.hypothesis.terms, tried.fit.as_ref()?)));
    let mut all: Vec<Rival> = laws.chain(terms).chain(effects(pass, lead)).collect();
    all.sort_by(|a, b| a.behind.total_cmp(&b.behind));
    all
}

/// Effects beside a law, and by how much more the cost is with each.
pub(super) fn effects(pass: &Pass, lead: &dyn Fn(&Fit) -> f64) -> Vec<Rival> {
    let effects = pass.tried.iter().filter(|tried| !tried.is_nothing()).filter_map(|tried| {
        let own = tried.hypothesis.inserts.last()?;
        Some(Rival { equation: String::new(), shape: own.label(), behind: lead(tried.fit.as_ref()?) })
    });
    effects.collect()
}
