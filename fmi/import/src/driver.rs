//! What both kinds of use have in common: the process, its parameters and texts, its inputs.

use std::ffi::CString;
use std::sync::Arc;

use hyd_system::given;
use hyd_system::{AssertionReport, InputError, ParameterError, Pattern, Series};

use crate::archive::Unit;
use crate::colours::Colours;
use crate::description::{Description, Interface, Kind, Number, State};
use crate::fault::Fault;
use crate::folder::Folder;
use crate::foreign::c_text;
use crate::host::{Host, Refusal, Remote};
use crate::layout::{Layout, Watched};
use crate::protocol::{Group, Operation, Setup, values_of};
use crate::session::Beginning;

/// Words for texts that are set before a start.
const TEXTS: usize = 1 << 15;

/// Parameters, inputs and the process: what both kinds of use have in common.
pub(crate) struct Driver {
    pub(crate) layout: Layout,
    pub(crate) description: Arc<Description>,
    pub(crate) remote: Remote,
    begin: Begin,
    pub(crate) parameters: Vec<f64>,
    pub(crate) texts: Vec<(u32, CString)>,
    /// Start values of states that a run may begin with in place of the unit's own.
    starts: Vec<(Group, Option<f64>)>,
    /// Number of followers that change always; the others follow them.
    pub(crate) continuous: usize,
    pub(crate) input_values: Vec<f64>,
    pub(crate) tolerance: f64,
    pub(crate) stop: f64,
}

/// What a process is begun with.
struct Begin {
    host: Host,
    file: String,
    folder: Arc<Folder>,
    setup: Setup,
    room: usize,
}

impl Begin {
    fn remote(&self) -> Result<Remote, Fault> {
        Remote::begin(&self.host, (&self.file, &self.folder), &self.setup, self.room)
    }
}

impl Driver {
    pub(crate) fn new(
        unit: &Unit,
        host: &Host,
        driven: &[String],
        (interface, exchange): (&Interface, bool),
        (pattern, part): (&Pattern, Option<&Watched>),
    ) -> Result<Self, Fault> {
        let description = Arc::clone(&unit.description);
        let layout = Layout::new(&description, &unit.file, driven)?;
        let references = |wanted: fn(&State) -> usize| -> Vec<u32> {
            description.states.iter().map(|state| description.variables[wanted(state)].reference).collect()
        };
        let colours = match part {
            Some(watched) => {
                Colours::new(&by_states_and_inputs(pattern, values_of(&layout.inputs), values_of(&watched.groups)))
            }
            None => Colours::new(pattern),
        };
        let setup = Setup {
            version: description.version,
            exchange,
            library: unit.library(interface).display().to_string(),
            resources: unit.resources(),
            token: description.token.clone(),
            name: description.model.to_string(),
            states: if exchange { description.state_count() } else { 0 },
            indicators: if exchange { description.indicators } else { 0 },
            completed: interface.needs_completed_steps,
            warns: description.warns,
            slopes: interface.interpolates && layout.inputs.iter().all(|group| group.number == Number::Float64),
            directional: interface.directional
                && part.is_none_or(|watched| watched.derivable && is_wide(&layout.inputs)),
            state_references: references(|state| state.state),
            rate_references: references(|state| state.rate),
            outputs: layout.outputs.clone(),
            parameters: layout.parameters.clone(),
            inputs: layout.inputs.clone(),
            discrete: layout.discrete.clone(),
            watched: part.map_or_else(Vec::new, |watched| watched.groups.clone()),
            colours,
        };
        let room = TEXTS
            + 8 * description.state_count()
            + 2 * layout.values.len()
            + 8 * layout.settings.len()
            + layout.followers.len();
        let (file, folder) = (unit.file.clone(), Arc::clone(&unit.folder));
        let begin = Begin { host: host.clone(), file, folder, setup, room };
        let remote = begin.remote()?;
        Ok(Self {
            begin,
            parameters: layout.values.clone(),
            texts: Vec::new(),
            starts: Vec::new(),
            continuous: values_of(&layout.inputs),
            input_values: vec![0.0; layout.followers.len()],
            layout,
            description,
            remote,
            tolerance: 1e-6,
            stop: f64::INFINITY,
        })
    }

    /// Columns of the Jacobian: where the rows of each begin, and the rows.
    pub(crate) fn columns(&self) -> (&[u32], &[u32]) {
        (&self.begin.setup.colours.starts, &self.begin.setup.colours.rows)
    }

    /// See [`DaeSystem::set_parameter`].
    pub(crate) fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        let setting = self.layout.setting_of.get(index).copied().flatten();
        let setting = setting.ok_or(ParameterError::NotSettable)?;
        if !value.is_finite() {
            return Err(ParameterError::BadValue);
        }
        self.layout.settings[setting].is_set = true;
        self.parameters[index] = value;
        Ok(())
    }

    /// Hands over the value that a text has for a parameter.  Where nobody has set it and it is what the unit states, the parameter is left alone,
    /// because the unit may find it from others (`U_0 = U` of a component), which may have been set.
    pub(crate) fn hand_parameter(&mut self, index: usize, value: f64, is_set: bool) {
        if self.set_parameter(index, value).is_err() || is_set {
            return;
        }
        let layout = &mut self.layout;
        let Some(setting) = layout.setting_of.get(index).copied().flatten() else { return };
        let setting = &mut layout.settings[setting];
        let elements = setting.first..setting.first + setting.count;
        setting.is_set = elements.clone().any(|own| self.parameters[own] != layout.values[own]);
    }

    /// Sets a parameter of type String; none where the unit has none of that name.
    pub(crate) fn set_text(&mut self, name: &str, text: &str) -> Option<()> {
        let found = self.description.variables.iter().find(|variable| *variable.name == *name)?;
        if found.kind != Kind::Text || !found.sizes.is_empty() {
            return None;
        }
        self.texts.push((found.reference, c_text(text)));
        Some(())
    }

    /// Where the start value of a state is set from now on; none where the unit has no state of that name, or finds its start by itself.
    pub(crate) fn start_of(&mut self, name: &str) -> Option<usize> {
        let variable = self.description.variables.iter().find(|variable| *variable.name == *name)?;
        let number = variable.number(self.description.version).filter(|_| self.description.is_start_free(variable))?;
        self.starts.push((Group { number, references: vec![variable.reference], values: 1 }, None));
        Some(self.starts.len() - 1)
    }

    /// Sets a start value by its position; that of the unit itself leaves it alone.
    pub(crate) fn set_start(&mut self, position: usize, value: f64) {
        let Some((group, start)) = self.starts.get_mut(position) else { return };
        let own = self.description.variables.iter().find(|own| group.references == [own.reference]);
        *start = (value.is_finite() && own.is_none_or(|own| own.start != [value])).then_some(value);
    }

    /// What a start value is set by.
    pub(crate) fn start_group(&self, position: usize) -> Option<&Group> {
        self.starts.get(position).map(|(group, _)| group)
    }

    /// The first parameter that was set to a value outside its limits, as a sentence.
    pub(crate) fn outside(&self) -> Option<String> {
        let set = self.layout.settings.iter().filter(|setting| setting.is_set);
        set.flat_map(|setting| (0..setting.count).map(move |element| (setting, element))).find_map(
            |(setting, element)| {
                let variable = &self.description.variables[setting.variable];
                let info = self.layout.tables.variables.iter().find(|info| *info.name.parts[0].0 == *variable.name)?;
                let (name, value) = (|| info.name.element(element), self.parameters[setting.first + element]);
                given::outside(name, &info.kind, value, (variable.min, variable.max)).map(|outside| outside.message)
            },
        )
    }

    /// A new process where the old one is lost, so that one run that fails is not the end of all others.
    pub(crate) fn revive(&mut self) -> Result<(), Fault> {
        if self.remote.fault.is_some() {
            self.remote = self.begin.remote()?;
        }
        Ok(())
    }

    /// What the unit has said since the last question, as reports of a run.
    pub(crate) fn reports(&mut self) -> Vec<AssertionReport> {
        let said = self.remote.said();
        let report = |text: String| AssertionReport {
            message: format!("`{}` says: {text}", self.begin.file),
            error: false,
            file: "".into(),
            line: 0,
        };
        said.into_iter().map(report).collect()
    }

    /// What is set before a run from `t0` (s).
    pub(crate) fn beginning(&mut self, t0: f64) -> Result<Beginning, String> {
        let mut values = Vec::new();
        for setting in self.layout.settings.iter().filter(|setting| setting.is_set) {
            let variable = &self.description.variables[setting.variable];
            let own = self.parameters[setting.first..setting.first + setting.count].to_vec();
            if own.iter().any(|value| value.is_nan()) {
                return Err(format!("`{}` has no start values, so all of its elements must be set", variable.name));
            }
            let group = Group { number: setting.number, references: vec![variable.reference], values: setting.count };
            values.push((group, own));
        }
        let starts = self.starts.iter().filter_map(|(group, value)| Some((group.clone(), vec![(*value)?])));
        values.extend(starts);
        for follower in &mut self.layout.followers {
            follower.start(t0)?;
        }
        self.move_inputs(t0);
        let inputs = self.input_values.clone();
        let texts = self.texts.clone();
        Ok(Beginning { start: t0, stop: self.stop, tolerance: self.tolerance, values, texts, inputs })
    }

    /// Values of all inputs at a time.
    pub(crate) fn move_inputs(&mut self, t: f64) {
        for (value, follower) in self.input_values.iter_mut().zip(&mut self.layout.followers) {
            *value = follower.at(t).value;
        }
    }

    /// Reads the values of all parameters after a start.
    pub(crate) fn read_parameters(&mut self) -> Result<(), Refusal> {
        if self.parameters.is_empty() {
            return Ok(());
        }
        let mut reader = self.remote.ask(Operation::Parameters, |_| {})?;
        reader.reals(&mut self.parameters);
        Ok(())
    }

    /// Lets an input follow samples.
    pub(crate) fn follow(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.layout.followers.get_mut(input).ok_or(InputError::Unknown)?.follow(series)
    }
}

/// Rates by states as they are known to depend on each other, below them what is watched, beside them the inputs: all of that perhaps.
fn by_states_and_inputs(pattern: &Pattern, inputs: usize, watched: usize) -> Pattern {
    let (n, rows) = (pattern.rows, (pattern.rows + watched) as u32);
    let own = (0..n).flat_map(|c| pattern.column(c).map(move |k| (k, c)));
    let own = own.map(|(k, c)| (pattern.row_indices[k], c as u32));
    let below = (0..n as u32).flat_map(|c| (n as u32..rows).map(move |r| (r, c)));
    let beside = (n as u32..(n + inputs) as u32).flat_map(|c| (0..rows).map(move |r| (r, c)));
    Pattern::from_pairs(rows as usize, n + inputs, &own.chain(below).chain(beside).collect::<Vec<_>>())
}

/// All of them have numbers of eight bytes.
fn is_wide(groups: &[Group]) -> bool {
    groups.iter().all(|group| group.number == Number::Float64)
}

/// Who made a unit.
pub(crate) fn tool(description: &Description) -> &str {
    if description.tool.is_empty() { "which it does not name" } else { &description.tool }
}
