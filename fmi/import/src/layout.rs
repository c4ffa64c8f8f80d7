//! Where the values of a unit stand: tables for results and parameters, and the groups of variables that one call reads or writes.
//!
//! Parameters and everything fixed are places among the parameters, all else places in a row of results; variables with one number
//! share a place.  Inputs that nothing drives are parameters, as in models of this program.

use std::collections::HashMap;
use std::sync::Arc;

use hyd_system::{
    InputSite, NamePattern, Place, RootInfo, Settable, Source, Tables, ValueKind, Variability, VariableInfo,
};

use crate::description::{Causality, Changes, Description, Kind, Number, Variable};
use crate::fault::Fault;
use crate::followers::Follower;
use crate::protocol::Group;

/// A parameter or input that can be set before a start.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// Position among the variables of the description.
    pub(crate) variable: usize,
    pub(crate) number: Number,
    /// Its elements among the parameters.
    pub(crate) first: usize,
    pub(crate) count: usize,
    /// It has been set.
    pub(crate) is_set: bool,
}

/// Everything about a unit that does not change while it is used.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) tables: Arc<Tables>,
    pub(crate) outputs: Vec<Group>,
    pub(crate) parameters: Vec<Group>,
    /// Groups of inputs that change always, and of those that change at events.
    pub(crate) inputs: Vec<Group>,
    pub(crate) discrete: Vec<Group>,
    /// Followers of the inputs in the order of these groups, continuous ones first; `sites` are in the same order.
    pub(crate) followers: Vec<Follower>,
    pub(crate) sites: Vec<InputSite>,
    /// Values of the parameters before a start, NaN where the unit has them alone.
    pub(crate) values: Vec<f64>,
    pub(crate) settings: Vec<Setting>,
    /// What cannot be set: nothing among the settings stands there.
    pub(crate) setting_of: Vec<Option<usize>>,
    /// Sentences on what is left out.
    pub(crate) notes: Vec<String>,
}

/// Variables of one kind of place, each number once, type by type.
#[derive(Default)]
struct Places {
    /// Type and number to position in `list`.
    known: HashMap<(Number, u32), usize>,
    list: Vec<(Number, u32, usize)>,
    /// Per item of the list: where its values begin; after [`Places::groups`].
    first: Vec<usize>,
}

impl Places {
    fn add(&mut self, number: Number, reference: u32, count: usize) -> usize {
        *self.known.entry((number, reference)).or_insert_with(|| {
            self.list.push((number, reference, count));
            self.list.len() - 1
        })
    }

    /// The groups, in whose order the values stand.
    fn groups(&mut self) -> Vec<Group> {
        let mut order: Vec<usize> = (0..self.list.len()).collect();
        order.sort_by_key(|&k| self.list[k].0);
        self.first = vec![0; self.list.len()];
        let (mut groups, mut at): (Vec<Group>, usize) = (Vec::new(), 0);
        for k in order {
            let (number, reference, count) = self.list[k];
            if groups.last().is_none_or(|group| group.number != number) {
                groups.push(Group { number, references: Vec::new(), values: 0 });
            }
            if let Some(group) = groups.last_mut() {
                group.references.push(reference);
                group.values += count;
            }
            self.first[k] = at;
            at += count;
        }
        groups
    }

    fn values(&self) -> usize {
        self.list.iter().map(|(_, _, count)| count).sum()
    }
}

/// Where a variable goes.
enum Role {
    Parameter,
    Output,
    /// A number that never changes.
    Constant,
}

/// Variables that are read at every point, where a unit is a part of a larger system.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watched {
    /// Groups of variables.
    pub(crate) groups: Vec<Group>,
    /// Where each of the names stands among the values of the groups.
    pub(crate) places: Vec<usize>,
    /// Its size, for errors.
    pub(crate) nominals: Vec<f64>,
    /// All of them are outputs or states with numbers of eight bytes, of which derivatives may be asked (2.0.4, table 9; 3.0.2, section 2.2.11).
    pub(crate) derivable: bool,
}

impl Watched {
    /// The variables with these names, elements of arrays among them.
    ///
    /// # Errors
    /// The first name that the unit does not have.
    pub(crate) fn new(description: &Description, names: &[String]) -> Result<Self, String> {
        let mut places = Places::default();
        let mut found = Vec::with_capacity(names.len());
        let mut derivable = true;
        for name in names {
            let element = |variable: &Variable| {
                let pattern = pattern(variable);
                (0..variable.count()).find(|&k| pattern.element(k) == *name)
            };
            let begins = |variable: &&Variable| name.starts_with(&*variable.name);
            let candidates = description.variables.iter().filter(begins);
            let of = candidates.filter_map(|variable| Some((variable, element(variable)?))).next();
            let (variable, element) = of.ok_or_else(|| name.clone())?;
            let number = variable.number(description.version).ok_or_else(|| name.clone())?;
            let place = places.add(number, variable.reference, variable.count());
            derivable &= number == Number::Float64 && variable.causality == Causality::Output;
            found.push((place, element, variable.nominal.unwrap_or(1.0)));
        }
        let groups = places.groups();
        let at = found.iter().map(|(place, element, _)| places.first[*place] + element).collect();
        let nominals = found.iter().map(|(_, _, nominal)| *nominal).collect();
        Ok(Self { groups, places: at, nominals, derivable })
    }
}

impl Layout {
    /// The layout of a unit of which the inputs with these names follow recorded samples.
    pub(crate) fn new(description: &Description, file: &str, driven: &[String]) -> Result<Self, Fault> {
        let mut notes = Vec::new();
        let refused = |what: &str, names: Vec<&str>| format!("{what} are not recorded: {}", shortened(&names));
        let of = |wanted: &dyn Fn(&Variable) -> bool| -> Vec<&str> {
            description.variables.iter().filter(|v| wanted(v)).map(|v| &*v.name).collect()
        };
        let clocks = of(&|v| v.kind == Kind::Clock && v.causality == Causality::Input);
        if !clocks.is_empty() {
            let sentence = format!(
                "the unit has clocks that its importer must tick, which hyd does not do: {}",
                shortened(&clocks)
            );
            return Err(Fault::of(file, sentence));
        }
        for (what, kind) in [("texts", Kind::Text), ("variables of type Binary", Kind::Binary), ("clocks", Kind::Clock)]
        {
            let is_open = |v: &Variable| {
                v.kind == kind
                    && !matches!(v.causality, Causality::Parameter | Causality::Input | Causality::Structural)
            };
            let names = of(&is_open);
            if !names.is_empty() {
                notes.push(refused(what, names));
            }
        }
        let driven = Driven { names: driven };
        let numbered: Vec<(usize, Number)> = description
            .variables
            .iter()
            .enumerate()
            .filter(|(_, v)| v.causality != Causality::Independent)
            .filter_map(|(k, v)| Some((k, v.number(description.version)?)))
            .collect();
        let (mut outputs, mut parameters) = (Places::default(), Places::default());
        let mut found = Vec::with_capacity(numbered.len());
        for &(k, number) in &numbered {
            let variable = &description.variables[k];
            let role = role(variable, &driven);
            let place = match role {
                Role::Parameter => parameters.add(number, variable.reference, variable.count()),
                Role::Output => outputs.add(number, variable.reference, variable.count()),
                Role::Constant => 0,
            };
            found.push((k, number, role, place));
        }
        let (output_groups, parameter_groups) = (outputs.groups(), parameters.groups());
        let mut values = vec![f64::NAN; parameters.values()];
        let mut settings: Vec<Setting> = Vec::new();
        let mut setting_of = vec![None; values.len()];
        let mut infos = Vec::with_capacity(found.len());
        for (k, number, role, place) in found {
            let variable = &description.variables[k];
            let count = variable.count();
            let sources: Vec<Source> = match role {
                Role::Parameter => {
                    let first = parameters.first[place];
                    if variable.start.len() == count {
                        values[first..first + count].copy_from_slice(&variable.start);
                    }
                    if is_settable(variable) && count > 0 && setting_of[first].is_none() {
                        setting_of[first..first + count].fill(Some(settings.len()));
                        settings.push(Setting { variable: k, number, first, count, is_set: false });
                    }
                    (first..first + count).map(|at| Place::Parameter(at as u32)).map(plain).collect()
                }
                Role::Output => {
                    let first = outputs.first[place];
                    (first..first + count).map(|at| Place::Output(at as u32)).map(plain).collect()
                }
                Role::Constant => variable.start.iter().map(|&value| plain(Place::Constant(value))).collect(),
            };
            infos.push((k, info(variable, &role, sources)));
        }
        let (inputs, discrete, followers, sites) = inputs(description, &driven);
        let position: HashMap<usize, u32> = infos.iter().enumerate().map(|(at, (k, _))| (*k, at as u32)).collect();
        let unknowns = description.states.iter().flat_map(|state| {
            let at = position.get(&state.state).copied().unwrap_or_default();
            (0..description.variables[state.state].count() as u32).map(move |element| (at, element))
        });
        let roots = (0..description.indicators).map(|k| RootInfo {
            text: format!("event indicator {} of the unit", k + 1).into(),
            file: file.into(),
            line: 1,
        });
        let tables = Tables {
            model: description.model.clone(),
            unknowns: unknowns.collect(),
            variables: infos.into_iter().map(|(_, info)| info).collect(),
            roots: roots.collect(),
            ..Tables::default()
        };
        Ok(Self {
            tables: Arc::new(tables),
            outputs: output_groups,
            parameters: parameter_groups,
            inputs,
            discrete,
            followers,
            sites,
            values,
            settings,
            setting_of,
            notes,
        })
    }
}

/// Names that the table of inputs has.
struct Driven<'a> {
    names: &'a [String],
}

impl Driven<'_> {
    /// A variable is driven where a column has its name or that of an element.
    fn has(&self, variable: &Variable) -> bool {
        if variable.causality != Causality::Input {
            return false;
        }
        match variable.sizes.is_empty() {
            true => self.names.iter().any(|name| **name == *variable.name),
            false => {
                let begins =
                    |name: &String| name.strip_prefix(&*variable.name).is_some_and(|rest| rest.starts_with('['));
                self.names.iter().any(begins)
            }
        }
    }
}

fn plain(place: Place) -> Source {
    Source { place, negated: false }
}

fn role(variable: &Variable, driven: &Driven<'_>) -> Role {
    let fixed = matches!(variable.changes, Changes::Constant | Changes::Fixed | Changes::Tunable);
    match variable.causality {
        Causality::Input if driven.has(variable) => Role::Output,
        Causality::Input | Causality::Parameter | Causality::Structural | Causality::Calculated => Role::Parameter,
        _ if variable.changes == Changes::Constant && variable.start.len() == variable.count() => Role::Constant,
        _ if fixed => Role::Parameter,
        _ => Role::Output,
    }
}

/// It can be set before the start.
fn is_settable(variable: &Variable) -> bool {
    matches!(variable.causality, Causality::Parameter | Causality::Input) && variable.changes != Changes::Constant
}

/// The name with its subscripts, which in a derivative belong to the state: `der(x[1])`.
fn pattern(variable: &Variable) -> NamePattern {
    let inner = variable.name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')'));
    match inner.filter(|_| !variable.sizes.is_empty()) {
        Some(inner) => NamePattern { parts: vec![(inner.into(), variable.sizes.clone())], derivative: true },
        None => NamePattern { parts: vec![(variable.name.clone(), variable.sizes.clone())], derivative: false },
    }
}

fn info(variable: &Variable, role: &Role, sources: Vec<Source>) -> VariableInfo {
    let kind = match &variable.kind {
        Kind::Number(Number::Float32 | Number::Float64) => ValueKind::Real,
        Kind::Number(Number::Boolean) => ValueKind::Boolean,
        // Only literals counted from 1 are those of this program.
        Kind::Enumeration(literals)
            if !literals.is_empty() && literals.iter().zip(1..).all(|((_, value), k)| *value == k) =>
        {
            ValueKind::Enumeration(literals.iter().map(|(name, _)| name.clone()).collect())
        }
        _ => ValueKind::Integer,
    };
    let variability = match (role, variable.changes) {
        (Role::Constant, _) | (_, Changes::Constant) => Variability::Constant,
        (Role::Parameter, _) => Variability::Parameter,
        (Role::Output, Changes::Discrete) => Variability::Discrete,
        (Role::Output, _) => Variability::Continuous,
    };
    let settable = match (role, variable.causality) {
        (Role::Parameter, Causality::Structural) => Settable::Structural,
        (Role::Parameter, _) if is_settable(variable) => Settable::Yes,
        _ => Settable::No,
    };
    VariableInfo {
        name: pattern(variable),
        unit: if kind == ValueKind::Real { variable.unit.clone() } else { "".into() },
        display_unit: variable.display_unit.clone(),
        description: variable.description.clone(),
        kind,
        variability,
        settable,
        protected: false,
        sources,
    }
}

/// Groups, followers and sites of the inputs that follow samples.
fn inputs(description: &Description, driven: &Driven<'_>) -> (Vec<Group>, Vec<Group>, Vec<Follower>, Vec<InputSite>) {
    let mut lists = [Vec::new(), Vec::new()];
    let (mut followers, mut sites) = (Vec::new(), Vec::new());
    for (list, wanted) in lists.iter_mut().zip([false, true]) {
        let mut places = Places::default();
        let mut members = Vec::new();
        for variable in description.variables.iter().filter(|variable| driven.has(variable)) {
            let Some(number) = variable.number(description.version) else { continue };
            let is_real = matches!(number, Number::Float32 | Number::Float64);
            let is_discrete = !is_real || variable.changes != Changes::Continuous;
            if is_discrete == wanted && !places.known.contains_key(&(number, variable.reference)) {
                let place = places.add(number, variable.reference, variable.count());
                members.push((place, variable, range(number)));
            }
        }
        *list = places.groups();
        members.sort_by_key(|(place, _, _)| places.first[*place]);
        for (_, variable, whole) in members {
            let pattern = pattern(variable);
            for element in 0..variable.count() {
                let name: Arc<str> = pattern.element(element).into();
                sites.push(InputSite { name: name.clone(), differentiated: false });
                followers.push(Follower::new(name, wanted, whole));
            }
        }
    }
    let [inputs, discrete] = lists;
    (inputs, discrete, followers, sites)
}

/// Least and largest value of integers; none for reals.
fn range(number: Number) -> Option<(f64, f64)> {
    Some(match number {
        Number::Float32 | Number::Float64 => return None,
        Number::Boolean => (0.0, 1.0),
        Number::Int8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        Number::UInt8 => (0.0, f64::from(u8::MAX)),
        Number::Int16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        Number::UInt16 => (0.0, f64::from(u16::MAX)),
        Number::Int32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        Number::UInt32 => (0.0, f64::from(u32::MAX)),
        Number::Int64 => (i64::MIN as f64, i64::MAX as f64),
        Number::UInt64 => (0.0, u64::MAX as f64),
    })
}

/// A few of many names.
pub(crate) fn shortened(names: &[&str]) -> String {
    const MOST: usize = 6;
    let list: Vec<String> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > MOST { ", ..." } else { "" };
    format!("{}{more}", list.join(", "))
}
