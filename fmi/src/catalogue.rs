//! Which number (value reference) names which variable, from the payload alone, so that description and library agree.
//!
//! 0 is the time; then all elements of all variables in the order of the tables; then what only the interface has: event indicators, and
//! where the choice of states changes during the run the states at present and their rates, else rates that no variable of the model
//! shows; then the Strings, which the payload does not know.  An array has the number of its first element.

use std::collections::BTreeMap;

use hyd_payload::Model;
use hyd_system::{Place, Settable, Source, Tables, VariableInfo};

/// The value reference of the time.
pub const TIME: u32 = 0;

/// What a value reference names.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Meaning {
    /// The time.
    Time,
    /// An element of a variable: index into the tables, element.
    Element(usize, usize),
    /// An event indicator.
    Indicator(usize),
    /// A state at present, where that varies.
    State(usize),
    /// The rate of a state at present, where that varies or the rate has no name.
    Rate(usize),
    /// A String.
    Text(usize),
}

/// The numbering of a model.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// Reference of the first element of each variable, and of what follows all of them.
    first: Vec<u32>,
    is_array: Vec<bool>,
    indicators: usize,
    /// Number of states, if they vary.
    varying: Option<usize>,
    /// States whose rates no variable shows, by their order.
    nameless: Vec<usize>,
    texts: usize,
}

impl Catalogue {
    /// The numbering of a model with so many Strings; none if it has more than fit.
    pub fn new(model: &Model, texts: usize) -> Option<Self> {
        let variables = &model.tables.variables;
        let mut first = Vec::with_capacity(variables.len() + 1);
        let mut next: u32 = TIME + 1;
        for info in variables {
            first.push(next);
            next = next.checked_add(u32::try_from(info.sources.len()).ok()?)?;
        }
        first.push(next);
        let states = model.structure.differential.iter().filter(|&&state| state).count();
        // Of each set of candidates all but the rows that are open are states at a time.
        let dependent: usize = model.candidates.iter().map(|set| set.open.len()).sum();
        let varying = (!model.candidates.is_empty()).then(|| states - dependent);
        let pairs = StateVariables::new(model).map_or_else(Vec::new, |states| states.pairs);
        let nameless: Vec<usize> = (0..pairs.len()).filter(|&k| pairs[k].1.is_none()).collect();
        let rest = model.structure.roots + 2 * varying.unwrap_or(0) + nameless.len() + texts;
        next.checked_add(u32::try_from(rest).ok()?)?;
        let whole = WholeArrays::new(model);
        let is_array = (0..variables.len()).map(|k| whole.holds(k)).collect();
        Some(Self { first, is_array, indicators: model.structure.roots, varying, nameless, texts })
    }

    /// True if the variable is one array for version 3.0; other arrays are given element by element.
    pub fn is_array(&self, variable: usize) -> bool {
        self.is_array[variable]
    }

    /// The number of an element of a variable.
    pub fn element(&self, variable: usize, element: usize) -> u32 {
        self.first[variable] + element as u32
    }

    /// The number of an event indicator.
    pub fn indicator(&self, k: usize) -> u32 {
        self.first.last().copied().unwrap_or_default() + k as u32
    }

    /// The numbers of a state at present and of its rate, where states vary.
    pub fn state(&self, k: usize) -> (u32, u32) {
        let begin = self.indicator(self.indicators) + 2 * k as u32;
        (begin, begin + 1)
    }

    /// The number of the rate of a state, by its order, that no variable shows.
    pub fn nameless_rate(&self, state: usize) -> Option<u32> {
        let begin = self.indicator(self.indicators) + 2 * self.varying.unwrap_or(0) as u32;
        self.nameless.iter().position(|&k| k == state).map(|k| begin + k as u32)
    }

    /// The number of a String.
    pub fn text(&self, k: usize) -> u32 {
        let before = self.indicators + 2 * self.varying.unwrap_or(0) + self.nameless.len();
        self.indicator(before + k)
    }

    /// How many states there are, if which they are varies.
    pub fn varying_states(&self) -> Option<usize> {
        self.varying
    }

    /// What a number names; none if it names nothing.
    pub fn meaning(&self, reference: u32) -> Option<Meaning> {
        if reference == TIME {
            return Some(Meaning::Time);
        }
        let end = self.first.last().copied().unwrap_or_default();
        if reference < end {
            let variable = self.first.partition_point(|&first| first <= reference) - 1;
            return Some(Meaning::Element(variable, (reference - self.first[variable]) as usize));
        }
        let k = (reference - end) as usize;
        match k.checked_sub(self.indicators) {
            None => Some(Meaning::Indicator(k)),
            Some(k) if k < 2 * self.varying.unwrap_or(0) => {
                Some(if k.is_multiple_of(2) { Meaning::State(k / 2) } else { Meaning::Rate(k / 2) })
            }
            Some(k) => {
                let k = k - 2 * self.varying.unwrap_or(0);
                match k.checked_sub(self.nameless.len()) {
                    None => Some(Meaning::Rate(self.nameless[k])),
                    Some(k) => (k < self.texts).then_some(Meaning::Text(k)),
                }
            }
        }
    }
}

/// Variables whose start value is a parameter of its own, `x.start`, which no importer sees: he sets the start of `x`.
#[derive(Clone, Debug, Default)]
pub struct Starts {
    /// For each of them the variable that the parameter is.
    pub parameter_of: BTreeMap<usize, usize>,
}

/// What names of such parameters end with.
const START: &str = ".start";

impl Starts {
    /// Those of a model, by their names.
    pub fn new(model: &Model) -> Self {
        let variables = &model.tables.variables;
        let is_open =
            |info: &VariableInfo| info.protected && info.settable == Settable::Yes && !info.sources.is_empty();
        let own = |info: &VariableInfo| info.name.element(0).strip_suffix(START).map(str::to_string);
        let parameters = variables.iter().enumerate().filter(|(_, info)| is_open(info));
        let parameters: BTreeMap<String, usize> = parameters.filter_map(|(k, info)| Some((own(info)?, k))).collect();
        if parameters.is_empty() {
            return Self::default();
        }
        let of = |(k, info): (usize, &VariableInfo)| {
            let parameter = parameters.get(&info.name.element(0)).filter(|_| !info.name.derivative)?;
            (variables[*parameter].sources.len() == info.sources.len()).then_some((k, *parameter))
        };
        let named = variables.iter().enumerate().filter(|(_, info)| !info.sources.is_empty());
        Self { parameter_of: named.filter_map(of).collect() }
    }
}

/// Where the states and rates of a model stand among the variables.
pub(crate) struct StateVariables {
    /// Variable and element of each state, and of its rate if a variable shows it.
    pub(crate) pairs: Vec<(Position, Option<Position>)>,
}

/// Variable and element.
type Position = (usize, usize);

impl StateVariables {
    /// None where which unknowns are states varies.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        if !model.candidates.is_empty() {
            return None;
        }
        let row = &model.row;
        let rates = positions(&model.tables, (row.assigned + row.unknowns) as usize, row.states.len());
        let pair = |(k, &unknown): (usize, &u32)| {
            let &(variable, element) = model.tables.unknowns.get(unknown as usize)?;
            Some(((variable as usize, element as usize), rates[k]))
        };
        Some(Self { pairs: row.states.iter().enumerate().map(pair).collect::<Option<_>>()? })
    }
}

/// Variable and element of each of `count` outputs from `begin` on, by their own name, not by that of a negative.
fn positions(tables: &Tables, begin: usize, count: usize) -> Vec<Option<(usize, usize)>> {
    let mut found = vec![None; count];
    for (variable, info) in tables.variables.iter().enumerate() {
        for (element, source) in info.sources.iter().enumerate() {
            if let Source { place: Place::Output(k), negated: false } = source
                && let Some(place) = (*k as usize).checked_sub(begin).and_then(|k| found.get_mut(k))
            {
                let derivative = info.name.derivative;
                // `der(x)` names a rate better than a variable that equals it.
                if place.is_none() || derivative {
                    *place = Some((variable, element));
                }
            }
        }
    }
    found
}

/// Which variables can be given as one array.
struct WholeArrays<'a> {
    variables: &'a [VariableInfo],
    /// Arrays of states or rates that are not complete or not in step.
    torn: Vec<bool>,
}

impl<'a> WholeArrays<'a> {
    fn new(model: &'a Model) -> Self {
        let variables = &model.tables.variables;
        let mut torn = vec![false; variables.len()];
        // Where the choice of states varies they are named one by one, and the arrays of candidates stay whole.
        if let Some(states) = StateVariables::new(model) {
            let mut rate_of = vec![None; variables.len()];
            let mut begin = vec![0; variables.len()];
            let mut count = vec![0; variables.len()];
            for (k, &((state, i), rate)) in states.pairs.iter().enumerate() {
                let Some((rate, j)) = rate else {
                    torn[state] = true;
                    continue;
                };
                let known = *rate_of[state].get_or_insert(rate);
                if i == 0 {
                    begin[state] = k;
                }
                // The elements must follow each other, as those of an array do in the vector of states.
                if known != rate || i != j || begin[state] + i != k {
                    (torn[state], torn[rate], torn[known]) = (true, true, true);
                }
                count[state] += 1;
                count[rate] += 1;
            }
            for &((state, _), rate) in &states.pairs {
                let Some((rate, _)) = rate else { continue };
                let whole = |k: usize| count[k] == variables[k].sources.len();
                if torn[state] || torn[rate] || !whole(state) || !whole(rate) {
                    (torn[state], torn[rate]) = (true, true);
                }
            }
        }
        Self { variables, torn }
    }

    fn holds(&self, k: usize) -> bool {
        let name = &self.variables[k].name;
        let bare = matches!(name.parts.as_slice(), [(_, sizes)] if !sizes.is_empty());
        bare && !self.variables[k].sources.is_empty() && !self.torn[k]
    }
}
