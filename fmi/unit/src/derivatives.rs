//! Directional derivatives of a model exchange: rates and variables by states and inputs.
//!
//! Rates and algebraic unknowns follow from the Jacobian of the equations by the implicit function theorem.  How inputs
//! enter, and how the other variables follow from all these, is found by central differences along the direction.

use hyd_fmi::Meaning;
use hyd_runtime::SolveError;
use hyd_system::{DaeSystem, Place};

use crate::core::{Core, Engine};
use crate::fault::Fault;

/// Step of central differences, relative to the size of what changes: error of rounding and of the method are alike.
const STEP: f64 = 6e-6;

/// A known of which derivatives are asked for.
enum Known {
    /// A state, with the sign with which the variable has it.
    State(usize, f64),
    Input(usize),
}

impl Core {
    /// The change of each unknown when each known changes by its seed.
    pub(crate) fn directional(&mut self, unknowns: &[u32], knowns: &[u32], seed: &[f64]) -> Result<Vec<f64>, Fault> {
        let places: Vec<Option<(u32, f64)>> = unknowns.iter().map(|&k| self.row_place(k)).collect::<Result<_, _>>()?;
        self.refresh()?;
        let mut dx = vec![0.0; self.state_count()];
        let mut du = vec![0.0; self.structure().inputs.len()];
        for (&reference, &value) in knowns.iter().zip(seed) {
            match self.known_of(reference)? {
                Known::State(k, sign) => dx[k] += sign * value,
                Known::Input(site) => du[site] += value,
            }
        }
        let residual = self.along_inputs(&du)?;
        let Engine::Exchange(exchange) = &mut self.engine else {
            return Err(Fault::usage("directional derivatives are for model exchange"));
        };
        let failed = |error: SolveError| Fault::discard(&error);
        let (dy, dyp) = exchange.tangent(&mut self.system, &dx, &residual).map_err(failed)?;
        let (t, (y, yp)) = (exchange.time(), exchange.point());
        let (y, yp) = (y.to_vec(), yp.to_vec());
        let known = self.known.clone();
        let row = &known.loaded.model.row;
        let (assigned, n) = (row.assigned, row.unknowns);
        let exact = |place: u32| match place.checked_sub(assigned) {
            Some(k) if k < n => Some(dy[k as usize]),
            Some(k) => row.states.get((k - n) as usize).map(|&state| dyp[state as usize]),
            None => None,
        };
        let mut moved = None;
        let mut result = Vec::with_capacity(places.len());
        for place in places {
            let Some((place, sign)) = place else {
                result.push(0.0);
                continue;
            };
            if let Some(value) = exact(place) {
                result.push(sign * value);
                continue;
            }
            if moved.is_none() {
                moved = Some(self.along((t, &y, &yp), (&dy, &dyp, &du)));
            }
            result.push(moved.as_ref().map_or(0.0, |values| sign * values[place as usize]));
        }
        Ok(result)
    }

    /// Position in the row of outputs of an unknown, with the sign that it has there; none for an output that parameters alone decide.
    fn row_place(&self, reference: u32) -> Result<Option<(u32, f64)>, Fault> {
        let row = &self.known.loaded.model.row;
        match self.known.catalogue.meaning(reference) {
            Some(Meaning::Element(variable, element)) => {
                let info = &self.known.loaded.model.tables.variables[variable];
                let source = info.sources[element];
                match source.place {
                    Place::Output(k) => Ok(Some((k, if source.negated { -1.0 } else { 1.0 }))),
                    Place::Parameter(_) | Place::Constant(_) => Ok(None),
                }
            }
            Some(Meaning::Rate(k)) => {
                let Engine::Exchange(exchange) = &self.engine else {
                    return Err(Fault::usage("directional derivatives are for model exchange"));
                };
                let state = exchange.state_unknowns().get(k).copied().unwrap_or_default();
                let position = row.states.binary_search(&state).unwrap_or_default();
                Ok(Some((row.assigned + row.unknowns + position as u32, 1.0)))
            }
            _ => Err(Fault::usage(format!("the variable {reference} is not an unknown of the model"))),
        }
    }

    fn known_of(&self, reference: u32) -> Result<Known, Fault> {
        let refused = || Fault::usage(format!("the variable {reference} is neither a state nor an input"));
        let Engine::Exchange(exchange) = &self.engine else {
            return Err(Fault::usage("directional derivatives are for model exchange"));
        };
        match self.known.catalogue.meaning(reference) {
            Some(Meaning::State(k)) => Ok(Known::State(k, 1.0)),
            Some(Meaning::Element(variable, element)) => {
                if let Some(&site) = self.known.inputs.get(&(variable, element)) {
                    return Ok(Known::Input(site));
                }
                let model = &self.known.loaded.model;
                let source = model.tables.variables[variable].sources[element];
                let Place::Output(place) = source.place else { return Err(refused()) };
                let unknown = place.checked_sub(model.row.assigned).ok_or_else(refused)?;
                let state = exchange.state_unknowns().iter().position(|&state| state == unknown);
                let sign = if source.negated { -1.0 } else { 1.0 };
                state.map(|state| Known::State(state, sign)).ok_or_else(refused)
            }
            _ => Err(refused()),
        }
    }

    /// What residuals change by when inputs do.
    fn along_inputs(&mut self, du: &[f64]) -> Result<Vec<f64>, Fault> {
        let n = self.structure().unknowns;
        if du.iter().all(|&value| value == 0.0) {
            return Ok(vec![0.0; n]);
        }
        let Engine::Exchange(exchange) = &self.engine else {
            return Err(Fault::usage("directional derivatives are for model exchange"));
        };
        let (t, (y, yp)) = (exchange.time(), exchange.point());
        let (y, yp) = (y.to_vec(), yp.to_vec());
        let h = step(du.iter().enumerate().map(|(k, &d)| (d, self.system.input_value(k).unwrap_or(0.0))));
        let mut sides = [vec![0.0; n], vec![0.0; n]];
        for (side, h) in sides.iter_mut().zip([h, -h]) {
            self.with_inputs(t, du, h, |system| system.residual(t, &y, &yp, side));
        }
        Ok(sides[0].iter().zip(&sides[1]).map(|(above, below)| (above - below) / (2.0 * h)).collect())
    }

    /// What all outputs change by along a direction.
    fn along(&mut self, (t, y, yp): (f64, &[f64], &[f64]), (dy, dyp, du): (&[f64], &[f64], &[f64])) -> Vec<f64> {
        let sizes = dy.iter().zip(y).chain(dyp.iter().zip(yp)).map(|(&d, &value)| (d, value));
        let h = step(sizes.chain(du.iter().enumerate().map(|(k, &d)| (d, self.system.input_value(k).unwrap_or(0.0)))));
        let mut sides = [self.row.clone(), self.row.clone()];
        for (side, h) in sides.iter_mut().zip([h, -h]) {
            let moved = |values: &[f64], d: &[f64]| values.iter().zip(d).map(|(v, d)| v + h * d).collect::<Vec<_>>();
            let (y, yp) = (moved(y, dy), moved(yp, dyp));
            self.with_inputs(t, du, h, |system| system.outputs(t, &y, &yp, side));
        }
        sides[0].iter().zip(&sides[1]).map(|(above, below)| (above - below) / (2.0 * h)).collect()
    }

    /// Does something with inputs that are moved along a direction, and puts them back.
    fn with_inputs(&mut self, t: f64, du: &[f64], h: f64, work: impl FnOnce(&mut dyn DaeSystem)) {
        let lines: Vec<_> = (0..du.len()).map(|site| self.system.line_of_input(site)).collect();
        for (site, (&d, line)) in du.iter().zip(&lines).enumerate() {
            if let Some((value, slope, from)) = *line {
                self.system.hold_input(site, value + slope * (t - from) + h * d, (slope, t));
            }
        }
        work(&mut self.system);
        for (site, line) in lines.into_iter().enumerate() {
            if let Some((value, slope, from)) = line {
                self.system.hold_input(site, value, (slope, from));
            }
        }
        self.system.set_time(t, false);
    }
}

/// The step along a direction: no value moves by more than the part that differences like, of its size or of 1.
fn step(directions: impl Iterator<Item = (f64, f64)>) -> f64 {
    let part = |(d, value): (f64, f64)| if d == 0.0 { f64::INFINITY } else { STEP * value.abs().max(1e-3) / d.abs() };
    let smallest = directions.map(part).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { STEP }
}
