//! Hand-written systems: a small trait that is easy to implement, and its translation to the solver's contract.
//!
//! A [`Model`] states residual, Jacobian and, where it has them, roots and events; [`Hand`] adds names, patterns and start
//! values.  Recorded variables are the unknowns by name, then their rates as `der(...)`, then discrete variables.
#![allow(dead_code)]

pub(crate) mod drive;
pub(crate) mod hybrid;
pub(crate) mod smooth;
pub(crate) mod stiff;
pub(crate) mod varied;
pub(crate) mod waves;

use std::sync::Arc;

use hyd_system::*;

/// A system by its formulas; discrete state lives in the model itself.
pub(crate) trait Model: Send {
    fn names(&self) -> Vec<String>;
    fn start(&self) -> Vec<f64>;
    fn differential(&self) -> Vec<bool> {
        vec![true; self.names().len()]
    }
    fn nominals(&self) -> Vec<f64> {
        vec![1.0; self.names().len()]
    }
    /// Patterns of dF/dy and dF/dy'; full unless stated.
    fn patterns(&self) -> (Pattern, Pattern) {
        let n = self.names().len();
        (Pattern::dense(n, n), Pattern::dense(n, n))
    }
    fn residual(&self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]);
    /// Values on the patterns, columns first.
    fn jacobian(&self, t: f64, y: &[f64], yp: &[f64], state: &mut [f64], rate: &mut [f64]);
    fn relations(&self) -> Vec<&'static str> {
        Vec::new()
    }
    fn roots(&self, _t: f64, _y: &[f64], _yp: &[f64], _out: &mut [f64]) {}
    fn held(&self, _out: &mut [bool]) {}
    fn bind(&mut self) {}
    /// Sets the one parameter, of models that have one.
    fn set(&mut self, _value: f64) -> bool {
        false
    }
    fn next_time_event(&self, _t: f64) -> f64 {
        f64::INFINITY
    }
    fn event(&mut self, _phase: EventPhase, _t: f64, _y: &mut [f64], _yp: &[f64]) -> EventChange {
        EventChange::default()
    }
    /// First guess of the initial unknowns; empty if the start is explicit.
    fn guess(&self) -> Vec<f64> {
        Vec::new()
    }
    fn initial_residual(&self, _z: &[f64], _out: &mut [f64]) {}
    /// Full, columns first.
    fn initial_jacobian(&self, _z: &[f64], _values: &mut [f64]) {}
    fn initial_store(&self, _z: &[f64], y: &mut [f64], yp: &mut [f64]) {
        y.copy_from_slice(&self.start());
        yp.fill(0.0);
    }
    fn discrete(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }
    fn assertion(&self, _t: f64, _y: &[f64]) -> Option<(&'static str, bool)> {
        None
    }
    fn loop_error(&self, _t: f64) -> Option<LoopError> {
        None
    }
}

/// A model as the solver sees it.
pub(crate) struct Hand<M> {
    pub model: M,
    structure: Structure,
    tables: Arc<Tables>,
}

impl<M: Model> Hand<M> {
    pub(crate) fn new(model: M) -> Self {
        let n = model.names().len();
        let (state_pattern, rate_pattern) = model.patterns();
        let discrete = model.discrete();
        let initial = model.guess().len();
        let structure = Structure {
            unknowns: n,
            differential: model.differential(),
            sizes: Vec::new(),
            state_pattern,
            rate_pattern,
            roots: model.relations().len(),
            outputs: 2 * n + discrete.len(),
            initial: InitialStructure { unknowns: initial, pattern: Pattern::dense(initial, initial) },
            delays: Vec::new(),
            inputs: Vec::new(),
        };
        let tables = Arc::new(tables(&model));
        Self { model, structure, tables }
    }
}

fn tables<M: Model>(model: &M) -> Tables {
    let variable = |name: NamePattern, place: usize| VariableInfo {
        name,
        unit: "m".into(),
        display_unit: "".into(),
        description: "".into(),
        kind: ValueKind::Real,
        variability: Variability::Continuous,
        settable: Settable::No,
        protected: false,
        sources: vec![Source { place: Place::Output(place as u32), negated: false }],
    };
    let names = model.names();
    let n = names.len();
    let mut variables: Vec<VariableInfo> =
        names.iter().enumerate().map(|(k, name)| variable(NamePattern::scalar(name.as_str()), k)).collect();
    for (k, name) in names.iter().enumerate() {
        variables.push(variable(NamePattern { derivative: true, ..NamePattern::scalar(name.as_str()) }, n + k));
    }
    for (k, (name, _)) in model.discrete().into_iter().enumerate() {
        variables.push(variable(NamePattern::scalar(name), 2 * n + k));
    }
    let equation = |k: usize| EquationInfo {
        component: "".into(),
        text: format!("equation of {}", names[k]).into(),
        file: "model.hyd".into(),
        line: k as u32 + 1,
    };
    let root =
        |(k, text): (usize, &&str)| RootInfo { text: (*text).into(), file: "model.hyd".into(), line: 100 + k as u32 };
    Tables {
        model: "Test".into(),
        variables,
        unknowns: (0..n as u32).map(|k| (k, 0)).collect(),
        rows: (0..n as u32).collect(),
        equations: (0..n).map(equation).collect(),
        roots: model.relations().iter().enumerate().map(root).collect(),
        initial_unknowns: names.iter().take(model.guess().len()).map(|name| name.as_str().into()).collect(),
        loops: Vec::new(),
        initial_rows: (0..model.guess().len() as u32).collect(),
    }
}

impl<M: Model> DaeSystem for Hand<M> {
    fn structure(&self) -> &Structure {
        &self.structure
    }
    fn tables(&self) -> &Arc<Tables> {
        &self.tables
    }
    fn parameters(&self) -> &[f64] {
        &[]
    }
    fn set_parameter(&mut self, _index: usize, value: f64) -> Result<(), ParameterError> {
        if self.model.set(value) { Ok(()) } else { Err(ParameterError::NotSettable) }
    }
    fn bind(&mut self, _t0: f64) -> Result<(), EvalFailure> {
        self.model.bind();
        Ok(())
    }
    fn nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.model.nominals());
    }
    fn tested(&self, out: &mut [bool]) {
        out.fill(true);
    }
    fn initial_nominals(&self, out: &mut [f64]) {
        out.fill(1.0);
    }
    fn initial_guess(&mut self, _t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        z.copy_from_slice(&self.model.guess());
        Ok(())
    }
    fn initial_residual(&mut self, _t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        self.model.initial_residual(z, out);
        Ok(())
    }
    fn initial_jacobian(&mut self, _t0: f64, z: &[f64], values: &mut [f64]) -> Result<(), EvalFailure> {
        values.fill(0.0);
        self.model.initial_jacobian(z, values);
        Ok(())
    }
    fn initial_store(&mut self, _t0: f64, z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure> {
        self.model.initial_store(z, y, yp);
        Ok(())
    }
    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.model.residual(t, y, yp, out);
    }
    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state.fill(0.0);
        rate.fill(0.0);
        self.model.jacobian(t, y, yp, state, rate);
    }
    fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.model.roots(t, y, yp, out);
    }
    fn held(&self, out: &mut [bool]) {
        self.model.held(out);
    }
    fn next_time_event(&mut self, t: f64) -> TimeEvent {
        TimeEvent::at(self.model.next_time_event(t))
    }
    fn unchanged_until(&mut self, _t: f64, until: f64) -> f64 {
        until
    }
    fn event_pass(&mut self, phase: EventPhase, t: f64, y: &mut [f64], yp: &[f64]) -> Result<EventChange, EvalFailure> {
        Ok(self.model.event(phase, t, y, yp))
    }
    fn outputs(&mut self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let n = y.len();
        out[..n].copy_from_slice(y);
        out[n..2 * n].copy_from_slice(yp);
        for (slot, (_, value)) in out[2 * n..].iter_mut().zip(self.model.discrete()) {
            *slot = value;
        }
    }
    fn find_excerpt(&mut self, _wanted: &[u32]) -> Option<Excerpt> {
        None
    }
    fn excerpt(&mut self, _number: usize, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.outputs(t, y, yp, out);
    }
    fn assertions(&mut self, t: f64, y: &[f64], _yp: &[f64], out: &mut Vec<AssertionReport>) {
        if let Some((message, error)) = self.model.assertion(t, y) {
            out.push(AssertionReport { message: message.into(), error, file: "model.hyd".into(), line: 200 });
        }
    }
    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        let mut out = vec![0.0; y.len()];
        self.model.residual(t, y, yp, &mut out);
        let row = out.iter().position(|v| !v.is_finite())?;
        Some(EvalFailure {
            equation: Some(row as u32),
            variable: Some(self.model.names()[row].clone()),
            reason: "not a number".into(),
            ..EvalFailure::default()
        })
    }
    fn diagnose_initial(&mut self, _t0: f64, _z: &[f64]) -> Option<EvalFailure> {
        None
    }
    fn homotopy(&mut self) -> Option<&mut dyn Homotopy> {
        None
    }
    fn torn_loops(&mut self) -> Option<&mut dyn TornLoops> {
        Some(self)
    }
    fn state_choices(&mut self) -> Option<&mut dyn StateChoices> {
        None
    }
    fn delays(&mut self) -> Option<&mut dyn Delays> {
        None
    }
    fn inputs(&mut self) -> Option<&mut dyn Inputs> {
        None
    }
    fn switches(&mut self) -> Option<&mut dyn Switches> {
        None
    }
    fn steps(&mut self) -> Option<&mut dyn Steps> {
        None
    }
    fn tangents(&mut self) -> Option<&mut dyn Tangents> {
        None
    }
}

impl<M: Model> TornLoops for Hand<M> {
    fn loop_error(&mut self, t: f64, _y: &[f64], _yp: &[f64]) -> Option<LoopError> {
        self.model.loop_error(t)
    }
    fn initial_loop_error(&mut self, _t0: f64, _z: &[f64]) -> Option<LoopError> {
        None
    }
}

/// Names `prefix1`, `prefix2`, ...
pub(crate) fn numbered(prefix: &str, n: usize) -> Vec<String> {
    (1..=n).map(|k| format!("{prefix}{k}")).collect()
}
