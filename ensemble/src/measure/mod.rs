//! What is measured of each run: extremes, means, integrals, instants, and expressions of them.
//!
//! A [`Measure`] is a text such as `max(y) - min(y)`, `when(y > 4e-3)` or `x/2`; variables outside of what takes the whole run
//! stand for their values at its end.  [`Follower`] takes the samples of one run and gives a number for each measure.  Texts are
//! read by `text.rs`, what is taken of a course is `course.rs`.

mod course;
mod text;

use hyd_results::Column;
use hyd_system::{Tables, ValueKind};

use course::Course;
use text::{Operation, Reduction, Term};

pub use text::MeasureError;

/// Something that is measured of each run.
#[derive(Clone, PartialEq, Debug)]
pub struct Measure {
    /// As the user wrote it; the name of its column.
    pub text: String,
    term: Term<String>,
}

impl Measure {
    /// Reads a text.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, MeasureError> {
        Ok(Self { text: text.trim().to_string(), term: text::parse(text)? })
    }

    /// The unit of what is measured, where that is plain to see; `""` if not.
    pub fn unit(&self, tables: &Tables) -> String {
        let variable = |term: &Term<String>| match term {
            Term::Variable(name) if name == "time" => "s".to_string(),
            Term::Variable(name) => tables.find(name).map_or_else(String::new, |(found, _)| found.unit.to_string()),
            _ => String::new(),
        };
        match &self.term {
            Term::Reduce(Reduction::When, _) => "s".to_string(),
            Term::Reduce(Reduction::Integral, _) => String::new(),
            Term::Reduce(_, inner) => variable(inner),
            term => variable(term),
        }
    }

    /// The variables of a model that it needs.
    ///
    /// # Errors
    /// A name that the model does not have, or a condition that is none.
    pub fn resolve(&self, tables: &Tables) -> Result<Resolved, MeasureError> {
        let fault = |reason: String| MeasureError { text: self.text.clone(), reason };
        let mut courses = Vec::new();
        let term = resolve(&self.term, tables, &mut courses).map_err(fault)?;
        Ok(Resolved { term, courses })
    }
}

/// A measure of a certain model.
#[derive(Clone, Debug)]
pub struct Resolved {
    /// Its variables are courses.
    term: Term<usize>,
    courses: Vec<(Term<Place>, Course)>,
}

impl Resolved {
    /// The positions in a row of outputs that it needs.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = u32> {
        let mut found = Vec::new();
        self.courses.iter().for_each(|(term, _)| outputs_of(term, &mut found));
        found.into_iter()
    }
}

fn outputs_of(term: &Term<Place>, found: &mut Vec<u32>) {
    match term {
        Term::Variable(Place::Column(column)) => {
            if let hyd_system::Place::Output(position) = column.source.place {
                found.push(position);
            }
        }
        Term::Apply(_, arguments) => arguments.iter().for_each(|argument| outputs_of(argument, found)),
        Term::Reduce(_, inner) => outputs_of(inner, found),
        Term::Above(sides, _) => sides.iter().for_each(|side| outputs_of(side, found)),
        Term::Number(_) | Term::Variable(Place::Time) => {}
    }
}

/// Where a value of a row stands.
#[derive(Clone, PartialEq, Debug)]
enum Place {
    Time,
    Column(Column),
}

/// The expression over courses, which are appended.
fn resolve(
    term: &Term<String>,
    tables: &Tables,
    courses: &mut Vec<(Term<Place>, Course)>,
) -> Result<Term<usize>, String> {
    let mut course = |term: Term<Place>, reduction, equal| {
        courses.push((term, Course::new(reduction, equal)));
        Term::Variable(courses.len() - 1)
    };
    Ok(match term {
        Term::Number(value) => Term::Number(*value),
        Term::Variable(_) => course(of_row(term, tables)?, Reduction::Final, false),
        Term::Apply(operation, arguments) => {
            let arguments = arguments.iter().map(|argument| resolve(argument, tables, courses));
            Term::Apply(*operation, arguments.collect::<Result<_, String>>()?)
        }
        Term::Reduce(Reduction::When, inner) => {
            let (difference, equal) = condition(inner, tables)?;
            course(difference, Reduction::When, equal)
        }
        Term::Reduce(Reduction::Rms, inner) => {
            let inner = of_row(inner, tables)?;
            course(Term::Apply(Operation::Multiply, vec![inner.clone(), inner]), Reduction::Rms, false)
        }
        Term::Reduce(reduction, inner) => course(of_row(inner, tables)?, *reduction, false),
        Term::Above(..) => return Err("a relation stands in `when` only".to_string()),
    })
}

/// What is positive when a condition holds, and whether zero is enough.
fn condition(term: &Term<String>, tables: &Tables) -> Result<(Term<Place>, bool), String> {
    match term {
        Term::Above(sides, equal) => {
            let sides = sides.iter().map(|side| of_row(side, tables)).collect::<Result<_, String>>()?;
            Ok((Term::Apply(Operation::Subtract, sides), *equal))
        }
        Term::Variable(name) if tables.find(name).is_some_and(|(variable, _)| variable.kind == ValueKind::Boolean) => {
            let half = Term::Number(0.5);
            Ok((Term::Apply(Operation::Subtract, vec![of_row(term, tables)?, half]), false))
        }
        _ => Err("`when` takes a condition, such as `y > 1`, or a Boolean variable".to_string()),
    }
}

/// An expression over the values of a row.
fn of_row(term: &Term<String>, tables: &Tables) -> Result<Term<Place>, String> {
    Ok(match term {
        Term::Number(value) => Term::Number(*value),
        Term::Variable(name) => Term::Variable(match tables.find(name) {
            Some((variable, element)) => {
                let source = variable.sources.get(element).ok_or_else(|| format!("`{name}` has no value"))?;
                Place::Column(Column { name: name.clone(), source: *source })
            }
            None if name == "time" => Place::Time,
            None => return Err(format!("the model has no variable `{name}`")),
        }),
        Term::Apply(operation, arguments) => {
            let arguments = arguments.iter().map(|argument| of_row(argument, tables));
            Term::Apply(*operation, arguments.collect::<Result<_, String>>()?)
        }
        Term::Above(..) | Term::Reduce(..) => return Err("a relation stands in `when` only".to_string()),
    })
}

/// The value of an expression; none where it holds what has no value.
fn value<V>(term: &Term<V>, of: &impl Fn(&V) -> f64) -> Result<f64, ()> {
    Ok(match term {
        Term::Number(value) => *value,
        Term::Variable(variable) => of(variable),
        Term::Apply(operation, arguments) => {
            let argument = |k: usize| arguments.get(k).map_or(Ok(0.0), |term| value(term, of));
            let (a, b) = (argument(0)?, argument(1)?);
            match operation {
                Operation::Add => a + b,
                Operation::Subtract => a - b,
                Operation::Multiply => a * b,
                Operation::Divide => a / b,
                Operation::Negate => -a,
                Operation::Call(function) => function.apply(a, b),
            }
        }
        Term::Reduce(..) | Term::Above(..) => return Err(()),
    })
}

/// Follows one run for all measures.
#[derive(Clone, Debug)]
pub(crate) struct Follower {
    measures: Vec<Resolved>,
}

impl Follower {
    pub(crate) fn new(measures: &[Resolved]) -> Self {
        Self { measures: measures.to_vec() }
    }

    /// The values of a row at time `t` (s).
    pub(crate) fn sample(&mut self, t: f64, row: &[f64], parameters: &[f64]) {
        let of = |place: &Place| match place {
            Place::Time => t,
            Place::Column(column) => column.value(row, parameters),
        };
        for (term, course) in self.measures.iter_mut().flat_map(|measure| &mut measure.courses) {
            course.sample(t, value(term, &of).unwrap_or(f64::NAN));
        }
    }

    /// What was measured, in the order of the measures.
    pub(crate) fn values(&mut self) -> Vec<f64> {
        let measured = |measure: &mut Resolved| {
            let courses: Vec<f64> = measure.courses.iter_mut().map(|(_, course)| course.value()).collect();
            value(&measure.term, &|&course: &usize| courses.get(course).copied().unwrap_or(f64::NAN))
        };
        self.measures.iter_mut().map(|measure| measured(measure).unwrap_or(f64::NAN)).collect()
    }
}
