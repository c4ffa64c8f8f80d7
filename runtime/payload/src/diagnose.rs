//! Which equation has no finite value, and why: the interpreter runs the routines until a store is not finite.
//!
//! Slow, and only for messages.  Assigned variables come first, since residuals repeat their faults.

use hyd_system::{EvalFailure, Place, Reading, Source, ValueKind};

use crate::instance::{Instance, Point};
use crate::loaded::Loaded;
use crate::memory::Memory;
use crate::names::{RowNames, Wrap};
use crate::program::{Area, RoutineId, TIME};
use crate::routines::{JacobianForm, PlanRoutines};
use crate::vm::{Fault, Read};

impl Instance {
    /// The first evaluation of a plan that is not finite.
    pub(crate) fn find_failure(&mut self, initial: bool, point: Point<'_>) -> Option<EvalFailure> {
        let loaded = self.loaded.clone();
        let (code, trace) = if initial {
            (&loaded.model.routines.initial, &loaded.model.rows[1])
        } else {
            (&loaded.model.routines.simulation, &loaded.model.rows[0])
        };
        let rows = trace.equations.len();
        let found = match self.fault(code.assign, point, 0, 0) {
            Some(fault) => Some((fault.index as usize, fault)),
            None => self.fault(code.residual, point, rows, 0).map(|fault| (row_of_value(code, trace, &fault), fault)),
        };
        if let Some((row, fault)) = found {
            let reads = readings(&loaded, trace, initial, &fault);
            let mut failure = EvalFailure { reads, ..failure(&loaded, trace, Some(row), fault.reason) };
            if !initial {
                self.read_as_written(&mut failure, point);
            }
            return Some(failure);
        }
        let (routine, sizes) = match &code.jacobian {
            JacobianForm::Entries(r) => (*r, [code.state_pattern.entries(), code.rate_pattern.entries()]),
            JacobianForm::Partials(r, accumulation, _) => (*r, [accumulation.length, 0]),
        };
        let fault = self.fault(routine, point, sizes[0], sizes[1])?;
        let row = row_of_entry(code, trace, &fault);
        Some(failure(&loaded, trace, row, format!("in its derivative: {}", fault.reason)))
    }

    /// Puts variables that stand in the equation as it is written, and were put together with others in the code, before what was read; zeros first.
    fn read_as_written(&mut self, failure: &mut EvalFailure, point: Point<'_>) {
        let loaded = self.loaded.clone();
        let tables = &loaded.model.tables;
        let Some(equation) = failure.equation.and_then(|equation| tables.equations.get(equation as usize)) else {
            return;
        };
        let mut row = vec![0.0; loaded.model.row.len()];
        self.output_row(point, &mut row);
        let mut written = Vec::new();
        for name in names(&equation.text) {
            let Some((variable, element)) = tables.find(name) else { continue };
            let is_known = |own: &Reading| own.name == name || failure.variable.as_deref() == Some(name);
            let Some(Source { place: Place::Output(place), negated }) = variable.sources.get(element).copied() else {
                continue;
            };
            let value = row[place as usize];
            if variable.kind != ValueKind::Real
                || failure.reads.iter().chain(&written).any(is_known)
                || !value.is_finite()
            {
                continue;
            }
            let value = if negated { 0.0 - value } else { value };
            written.push(Reading { name: name.to_string(), value, unit: variable.unit.to_string() });
        }
        written.append(&mut failure.reads);
        written.sort_by_key(|own| own.value != 0.0);
        failure.reads = written;
    }

    /// A failure of the initial system, in general words if it cannot be located.
    pub(crate) fn initial_failure(&mut self, z: &[f64]) -> EvalFailure {
        let found = self.find_failure(true, Point { unknown: z, rate: &[] });
        let reason = "an initial value is not a number".to_string();
        found.unwrap_or_else(|| EvalFailure { reason, ..EvalFailure::default() })
    }

    /// The first discrete variable that is not finite.
    pub(crate) fn discrete_failure(&mut self, point: Point<'_>) -> EvalFailure {
        let loaded = self.loaded.clone();
        let model = &loaded.model;
        let fault = self.fault(model.routines.events.discrete, point, 0, 0);
        let first = model.row.len() as u32 - model.row.discrete;
        let name = |fault: &Fault| {
            let k = fault.index.checked_sub(model.area.discrete.start)?;
            model.tables.name_at(Place::Output(first + k))
        };
        of_an_event(fault, name, "a discrete variable is not a number")
    }

    /// The first state that an event gives a value that is not finite.
    pub(crate) fn reinit_failure(&mut self, point: Point<'_>) -> EvalFailure {
        let loaded = self.loaded.clone();
        let events = &loaded.model.routines.events;
        let fault = self.fault(events.reinits, point, events.reinit_unknowns.len(), 0);
        let name = |fault: &Fault| {
            let unknown = events.reinit_unknowns.get(fault.index as usize)?;
            Some(loaded.model.tables.unknown_name(*unknown as usize))
        };
        of_an_event(fault, name, "a reinitialised state is not a number")
    }

    /// The first parameter or start value that is not finite after this routine.
    pub(crate) fn bind_failure(&mut self, routine: RoutineId, point: Point<'_>) -> Option<EvalFailure> {
        let loaded = self.loaded.clone();
        if self.memory.data.iter().all(|value| value.is_finite()) {
            return None;
        }
        let fault = self.fault(routine, point, 0, 0);
        let (index, reason) = match fault {
            Some(fault) => (Some(fault.index), fault.reason),
            None => (None, "not a number".into()),
        };
        let layout = &loaded.model.area;
        let name = index.and_then(|index| {
            let parameter = index.checked_sub(layout.parameters.start);
            match parameter.and_then(|k| layout.parameter_names.get(k as usize)) {
                Some(&name) => Some(name),
                None => layout.starts.iter().find(|&&(place, _)| place == index).map(|&(_, name)| name),
            }
        });
        let variable = name.map(|name| loaded.model.names.text(name));
        Some(EvalFailure { variable, reason, ..EvalFailure::default() })
    }

    fn fault(&mut self, routine: RoutineId, point: Point<'_>, out: usize, out2: usize) -> Option<Fault> {
        let (mut out, mut out2) = (vec![0.0; out], vec![0.0; out2]);
        let mut memory = Memory {
            data: &mut self.memory.data,
            unknown: point.unknown,
            rate: point.rate,
            work: &mut self.memory.work,
            out: &mut out,
            out2: &mut out2,
        };
        self.loaded.engine.first_fault(routine, &mut memory)
    }
}

fn of_an_event(fault: Option<Fault>, name: impl Fn(&Fault) -> Option<String>, general: &str) -> EvalFailure {
    let variable = fault.as_ref().and_then(name);
    let reason = fault.map_or_else(|| general.into(), |fault| fault.reason);
    EvalFailure { variable, reason, ..EvalFailure::default() }
}

fn failure(loaded: &Loaded, trace: &RowNames, row: Option<usize>, reason: String) -> EvalFailure {
    let target = row.and_then(|row| trace.targets.get(row).copied().flatten());
    EvalFailure {
        equation: row.and_then(|row| trace.equations.get(row).copied()),
        variable: target.map(|target| loaded.model.names.text(target)),
        reason,
        ..EvalFailure::default()
    }
}

/// What was read at a fault, by the names of the user; values without a name, as numbers of the text, say nothing.
fn readings(loaded: &Loaded, trace: &RowNames, initial: bool, fault: &Fault) -> Vec<Reading> {
    let model = &loaded.model;
    let name_of = |area: Area, index: u32| match area {
        Area::Work => trace.targets.get(index as usize).copied().flatten().map(|name| model.names.text(name)),
        Area::Unknown if initial => model.tables.initial_unknowns.get(index as usize).map(ToString::to_string),
        Area::Unknown => Some(model.tables.unknown_name(index as usize)),
        Area::Data if index == TIME => Some("time".to_string()),
        Area::Data if model.area.discrete.contains(&index) => {
            let first = model.row.len() as u32 - model.row.discrete;
            model.tables.name_at(Place::Output(first + index - model.area.discrete.start))
        }
        Area::Data => {
            let parameter = index.checked_sub(model.area.parameters.start);
            let start = || model.area.starts.iter().find(|&&(place, _)| place == index).map(|&(_, name)| name);
            let name = parameter.and_then(|k| model.area.parameter_names.get(k as usize).copied()).or_else(start)?;
            matches!(name.wrap, Wrap::Value | Wrap::Start).then(|| model.names.text(name))
        }
        _ => None,
    };
    let reading = |read: &Read| {
        let name = name_of(read.area, read.index)?;
        let variable = name.strip_suffix(".start").unwrap_or(&name);
        let unit = if name == "time" { Some("s".to_string()) } else { None };
        let unit = unit.unwrap_or_else(|| {
            model.tables.find(variable).map_or_else(String::new, |(variable, _)| variable.unit.to_string())
        });
        Some(Reading { name, value: read.value, unit })
    };
    fault.reads.iter().filter_map(reading).collect()
}

/// The names that stand in the text of an equation, with their subscripts.
fn names(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0;
    let ends = move |c: char| {
        depth += match c {
            '[' => 1,
            ']' => -1,
            _ => 0,
        };
        depth == 0 && c != ']' && !c.is_alphanumeric() && c != '_' && c != '.'
    };
    text.split(ends).filter(|own| own.starts_with(|c: char| c.is_alphabetic() || c == '_'))
}

/// The row of a fault in the residual routine.
fn row_of_value(code: &PlanRoutines, trace: &RowNames, fault: &Fault) -> usize {
    let assignments = trace.equations.len() - code.state_pattern.rows;
    match fault.area {
        Area::Work => fault.index as usize,
        _ => assignments + fault.index as usize,
    }
}

/// The row of a fault in the Jacobian routine.
fn row_of_entry(code: &PlanRoutines, trace: &RowNames, fault: &Fault) -> Option<usize> {
    let assignments = trace.equations.len() - code.state_pattern.rows;
    let index = fault.index as usize;
    let entry = |rows: &[u32]| rows.get(index).map(|&row| assignments + row as usize);
    match (&code.jacobian, fault.area) {
        (_, Area::Work) => Some(index),
        (JacobianForm::Partials(_, _, owners), _) => owners.row(fault.index).map(|row| row as usize),
        (JacobianForm::Entries(_), Area::Out) => entry(&code.state_pattern.row_indices),
        (JacobianForm::Entries(_), _) => entry(&code.rate_pattern.row_indices),
    }
}
