//! Forms with memory compared with what is left, without a run for each.
//!
//! For each equation that can be rewritten, the first question is how much any course at all would explain of the shot that is farthest from
//! the model.  At the likeliest ones the channels' answer to a course is found in all shots ([`crate::evidence::response`]).  Every form
//! ([`crate::terms::dynamics`]) along every variable of the equation, with numbers over all that the record can tell, is then a course whose score is
//! a product of matrices.

use std::rc::Rc;

use nalgebra::DVector;

use crate::catalogue::Site;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::location::{courses, farthest_shot};
use crate::evidence::projection::{Projection, Score};
use crate::evidence::response::{Corners, Response, corners};
use crate::fault::Fault;
use crate::fit::Fit;
use crate::search::context::Search;
use crate::search::pass::Pass;
use crate::terms::dictionary::{Place, Term, places};
use crate::terms::dynamics::{Dynamics, Form};
use crate::variant::Insert;

/// Equations at which forms are compared.
const EQUATIONS: usize = 6;
/// Forms that are fitted, and the share of what the best promises that each must promise.
const FITTED: (usize, f64) = (6, 0.3);
/// Corners of a course in one shot, at most, and samples for each; and as many at most where equations are compared.
const CORNERS: (usize, usize) = (192, 4);
const COARSE: usize = 48;
/// Correlation of variables that are the same but for rounding, less than one by so much.
const SAME: f64 = 1e-9;
/// A form with memory at an equation, compared with what is left.
pub(super) struct Screened {
    /// The equation, and those where a term does the same.
    pub term: Term,
    pub alike: usize,
    pub dynamics: Dynamics,
    /// The variable over time, shot by shot.
    pub variable: Rc<Vec<Vec<f64>>>,
    pub score: Score,
}

/// Equations at which a term does the same, each with the factor between it and the first.
type Alike<'a> = Vec<(&'a Place, f64)>;

/// Equations that are alike, and how much any course at one of them would explain of one shot.
struct Group<'a> {
    gain: f64,
    first: Corners,
    alike: Alike<'a>,
}

impl Search<'_> {
    /// All forms at the likeliest equations, and how many there were.
    pub(super) fn screen(&self, last: &Pass, fit: &Fit, declared: &[&Site]) -> Result<(Vec<Screened>, usize), Fault> {
        let (base, whole) = (&last.base, self.whole());
        let Some(projection) = Projection::new(fit) else { return Ok((Vec::new(), 0)) };
        let inserts: Vec<Insert> =
            base.inserts.iter().map(|own| Insert { candidate: own.clone(), values: Vec::new() }).collect();
        let (tables, names) = (base.machine.tables(), base.machine.channel_names());
        let paths: Vec<&str> = declared.iter().map(|site| site.path.as_str()).collect();
        let mut all = places(self.workshop.injection_sites(&inserts, names), (tables, names), &paths);
        all.retain(|place| self.is_writable(&place.term(), declared));
        let variables = all.iter().flat_map(|place| place.variables.iter().map(|(_, full)| full.clone()));
        let courses = courses(self.setup, self.workshop, base, &inserts, variables.collect(), (fit, &whole))?;
        let (mut screened, mut count) = (Vec::new(), 0);
        for (number, alike) in self.likely(base, fit, &all)?.into_iter().enumerate() {
            let Some(term) = alike.first().map(|(place, _)| place.term()) else { continue };
            let corners_of = |samples: usize| (samples / CORNERS.1).clamp(2, CORNERS.0);
            let found = corners(self.setup, self.workshop, (base, fit), &term, (&whole, &corners_of));
            let Some(response) = found.ok().and_then(|found| Response::new(&found, &whole)) else { continue };
            // Of variables that differ by a factor and a constant the first: not what the equation itself determines.
            let of_equation = term.of_equation.as_deref().unwrap_or_default();
            let unit_of = |full: &str| tables.find(full).map_or("", |(variable, _)| &*variable.unit);
            let mut variables: Vec<(&Place, f64, &(String, String))> = Vec::new();
            for (place, factor) in &alike {
                variables.extend(place.variables.iter().map(|own| (*place, *factor, own)));
            }
            variables.sort_by_key(|(.., (_, full))| unit_of(full) == of_equation);
            let mut known: Vec<DVector<f64>> = Vec::new();
            for (place, factor, (name, full)) in variables {
                let Some(shots) = courses.get(full) else { continue };
                let own = DVector::from_vec(shots.concat());
                let own = own.add_scalar(-own.mean()).normalize();
                if known.iter().any(|other| other.len() == own.len() && other.dot(&own).abs() > 1.0 - SAME) {
                    continue;
                }
                known.push(own);
                let variable = Rc::new(shots.clone());
                let along = Along { setup: self.setup, shots: &whole.shots, courses: shots };
                let Some((length, travel)) = along.extent() else { continue };
                let unit = unit_of(full);
                for form in Form::ALL {
                    for numbers in form.grid(length, response.resolution(), travel) {
                        let dynamics = Dynamics { form, driver: name.clone(), unit: unit.to_string(), numbers };
                        count += 1;
                        let course = |shot: usize| along.course(shot, &dynamics);
                        let Some(mut score) = response.score(&projection, &course) else { continue };
                        score.amplitude /= factor;
                        let (term, variable) = (place.term(), variable.clone());
                        screened.push(Screened { term, alike: number, dynamics, variable, score });
                    }
                }
            }
        }
        Ok((screened, count))
    }

    /// The equations where any course at all would explain most of the shot that is farthest from the model.  Those of which a term would do
    /// the same stand together, each with the factor between them and the first.
    fn likely<'a>(&self, base: &Hypothesis, fit: &Fit, all: &'a [Place]) -> Result<Vec<Vec<(&'a Place, f64)>>, Fault> {
        let (alone, weighing) = farthest_shot(&base.problem(self.setup)?, fit, &self.whole());
        let corners_of = |samples: usize| (samples / CORNERS.1).clamp(2, COARSE);
        let mut groups: Vec<Group<'a>> = Vec::new();
        for place in all {
            let found = corners(self.setup, self.workshop, (base, &alone), &place.term(), (&weighing, &corners_of));
            let Some(first) = found.ok().and_then(|mut found| found.pop()) else { continue };
            let known = groups.iter_mut().find_map(|group| Some((group.first.factor_of(&first)?, &mut group.alike)));
            if let Some((factor, alike)) = known {
                alike.push((place, factor));
            } else if let Some(gain) = first.gain() {
                groups.push(Group { gain, first, alike: vec![(place, 1.0)] });
            }
        }
        groups.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        groups.truncate(EQUATIONS);
        Ok(groups.into_iter().map(|group| group.alike).collect())
    }
}

/// The best of each equation, variable and kind of memory, as far as they promise enough.
pub(super) fn likeliest(mut screened: Vec<Screened>, needed: f64) -> Vec<Screened> {
    screened.sort_by(|a, b| b.score.gain.total_cmp(&a.score.gain));
    let enough = screened.first().map_or(0.0, |best| FITTED.1 * best.score.gain).max(needed);
    let mut chosen: Vec<Screened> = Vec::new();
    for own in screened {
        let is_same = |other: &Screened| {
            own.alike == other.alike
                && own.dynamics.driver == other.dynamics.driver
                && own.dynamics.form == other.dynamics.form
        };
        if chosen.len() < FITTED.0 && own.score.gain >= enough && !chosen.iter().any(is_same) {
            chosen.push(own);
        }
    }
    chosen
}

/// A variable along the shots of a fit.
struct Along<'a> {
    setup: &'a crate::Setup,
    shots: &'a [usize],
    /// On the output points of each of these shots.
    courses: &'a [Vec<f64>],
}

impl<'a> Along<'a> {
    /// Length of the longest shot (s), and the farthest way that the integral of the variable goes; none of a variable that stands still.
    fn extent(&self) -> Option<(f64, f64)> {
        let (mut length, mut travel, mut ends) = (0.0_f64, 0.0_f64, (f64::INFINITY, f64::NEG_INFINITY));
        for (&shot, course) in self.shots.iter().zip(self.courses) {
            let span = &self.setup.data.shots[shot].span;
            length = length.max(span.stop - span.start);
            let (mut sum, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
            for value in course {
                sum += value * span.step();
                (low, high) = (low.min(sum), high.max(sum));
                ends = (ends.0.min(*value), ends.1.max(*value));
            }
            travel = travel.max(high - low);
        }
        let moves = ends.1 - ends.0 > 1e-9 * ends.0.abs().max(ends.1.abs());
        (moves && self.courses.len() == self.shots.len()).then_some((length, travel))
    }

    /// What a form makes of it in one shot.
    fn course(&self, shot: usize, dynamics: &Dynamics) -> Option<(&'a crate::machine::span::Span, Vec<f64>)> {
        let at = self.shots.iter().position(|&own| own == shot)?;
        let span = &self.setup.data.shots[shot].span;
        Some((span, dynamics.course(span, &self.courses[at])))
    }
}
