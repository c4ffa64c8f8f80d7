//! What stands where in the memory of a model, and identifiers made of names.

use hyd_flat::VarId;
use hyd_payload::{Name, Wrap};
use hyd_system::NamePattern;

use crate::program::{Area, HOMOTOPY, INITIAL, TIME};
use crate::shared::Shared;

/// Whose unknowns and assigned variables a routine sees.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Plan {
    /// Nobody's.
    None,
    /// Those of the simulation.
    Simulation,
    /// Those of the initial system.
    Initial,
}

/// Names of all places.
pub(super) struct Labels<'a> {
    shared: &'a Shared,
    /// First variable of each pattern.
    firsts: Vec<u32>,
    data: Vec<Option<String>>,
}

impl<'a> Labels<'a> {
    /// The names of a model.
    pub(super) fn new(shared: &'a Shared) -> Self {
        let mut next = 0;
        let first = |pattern: &NamePattern| {
            let first = next;
            next += pattern.count() as u32;
            first
        };
        let firsts = shared.loaded.model.names.0.iter().map(first).collect();
        let mut labels = Self { shared, firsts, data: Vec::new() };
        labels.data = labels.of_data();
        labels
    }

    fn of_data(&self) -> Vec<Option<String>> {
        let (layout, area) = (&self.shared.lowered.layout, &self.shared.loaded.model.area);
        let names = &self.shared.loaded.model.names;
        let mut data: Vec<Option<String>> = vec![None; area.length as usize];
        let mut put = |index: u32, text: String| data[index as usize] = Some(text);
        put(TIME, "time".into());
        put(INITIAL, "initial()".into());
        put(HOMOTOPY, "homotopy".into());
        for ((index, &name), given) in area.parameters.clone().zip(&area.parameter_names).zip(&area.given) {
            put(index, names.text(name));
            if let Some(given) = given {
                put(given.flag, format!("{} is given", names.text(name)));
                put(given.value, format!("{} as given", names.text(name)));
            }
        }
        for &(index, name) in &area.starts {
            put(index, names.text(name));
        }
        for ((index, before), &v) in area.discrete.clone().zip(area.pre.clone()).zip(&layout.discrete_vars) {
            put(index, names.text(self.name(v, Wrap::Value)));
            put(before, names.text(self.name(v, Wrap::Before)));
        }
        for &(v, index) in &layout.pre_continuous {
            put(index, names.text(self.name(v, Wrap::Before)));
        }
        let ranges = [
            (&area.held, "relation"),
            (&area.chosen, "choice"),
            (&area.delayed, "delayed"),
            (&area.delayed_rates, "delayed rate"),
            (&area.inputs, "input"),
            (&area.input_rates, "rate of input"),
        ];
        for (range, what) in ranges {
            range.clone().enumerate().for_each(|(k, index)| put(index, format!("{what} {}", k + 1)));
        }
        data
    }

    fn name(&self, v: VarId, wrap: Wrap) -> Name {
        let pattern = self.firsts.partition_point(|first| *first <= v.0) - 1;
        // Patterns without elements share their first variable with the next one.
        Name { pattern: pattern as u32, element: v.0 - self.firsts[pattern], wrap }
    }

    /// The number at a place of the data area that never changes.
    pub(super) fn constant(&self, index: u32) -> Option<f64> {
        let (layout, area) = (&self.shared.lowered.layout, &self.shared.loaded.model.area);
        let is_constant = (layout.constants..layout.parameters.start).contains(&index);
        is_constant.then(|| area.preset.iter().find(|(place, _)| *place == index).map_or(0.0, |(_, value)| *value))
    }

    /// The name of what stands at a place.
    pub(super) fn text(&self, area: Area, index: u32, plan: Plan) -> String {
        let model = &self.shared.loaded.model;
        let rows = if plan == Plan::Initial { &model.rows[1] } else { &model.rows[0] };
        let initial = |k: u32| model.tables.initial_unknowns.get(k as usize).map(|name| name.to_string());
        match area {
            Area::Data => self.data.get(index as usize).cloned().flatten().unwrap_or_else(|| "a number".into()),
            Area::Unknown if plan == Plan::Initial => initial(index).unwrap_or_default(),
            Area::Unknown => model.tables.unknown_name(index as usize),
            Area::Rate => format!("der({})", model.tables.unknown_name(index as usize)),
            Area::Work => {
                let target = rows.targets.get(index as usize).copied().flatten();
                target.map_or_else(|| format!("w {index}"), |name| model.names.text(name))
            }
            Area::Out | Area::Out2 => format!("{index}"),
        }
    }
}

/// Letters, digits and underscores that remind of a name.
pub(super) fn identifier(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        match c {
            'a'..='z' | 'A'..='Z' | '0'..='9' => text.push(c),
            _ if !text.ends_with('_') => text.push('_'),
            _ => {}
        }
    }
    let text = text.trim_matches('_');
    match text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => text.to_string(),
        false => format!("v{text}"),
    }
}
