//! An instance of a compiled model in the compiler's process: what executables run, and tangents beside it.
//!
//! Everything but tangents is the job of [`hyd_payload::Instance`]; derivatives along directions need code that is made when
//! directions are known, so only a process with the code generator has them.

use std::sync::Arc;

use hyd_payload::Instance;
use hyd_system::{
    AssertionReport, DaeSystem, EvalFailure, EventChange, EventPhase, InputError, LoopError, ParameterError, Series,
    StateChoice, Structure, Tables, Tangents, TimeEvent,
};

use crate::model::CompiledModel;
use crate::shared::Shared;
use crate::tangent::TangentMemory;

/// An instance of a compiled model.  [`Clone`] gives a further instance in the same condition for another thread.
#[derive(Clone, Debug)]
pub struct CompiledSystem {
    pub(crate) shared: Arc<Shared>,
    pub(crate) instance: Instance,
    /// Present once directions are set.
    pub(crate) tangents: Option<Box<TangentMemory>>,
}

impl CompiledModel {
    /// A further instance with its own memory; instances may run on different threads.
    pub fn instantiate(&self) -> CompiledSystem {
        CompiledSystem::new(self.shared.clone())
    }
}

impl CompiledSystem {
    fn new(shared: Arc<Shared>) -> Self {
        Self { instance: shared.loaded.instantiate(), shared, tangents: None }
    }

    /// The model that this is an instance of.
    pub fn model(&self) -> CompiledModel {
        CompiledModel { shared: self.shared.clone() }
    }
}

impl DaeSystem for CompiledSystem {
    fn structure(&self) -> &Structure {
        self.instance.structure()
    }

    fn tables(&self) -> &Arc<Tables> {
        self.instance.tables()
    }

    fn parameters(&self) -> &[f64] {
        self.instance.parameters()
    }

    fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        self.instance.set_parameter(index, value)
    }

    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.instance.bind(t0)
    }

    fn nominals(&self, out: &mut [f64]) {
        self.instance.nominals(out);
    }

    fn initial_nominals(&self, out: &mut [f64]) {
        self.instance.initial_nominals(out);
    }

    fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        self.instance.initial_guess(t0, z)
    }

    fn has_homotopy(&self) -> bool {
        self.instance.has_homotopy()
    }

    fn set_homotopy(&mut self, share: f64) {
        self.instance.set_homotopy(share);
    }

    fn initial_residual(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        self.instance.initial_residual(t0, z, out)
    }

    fn initial_jacobian(&mut self, t0: f64, z: &[f64], values: &mut [f64]) -> Result<(), EvalFailure> {
        self.instance.initial_jacobian(t0, z, values)
    }

    fn initial_store(&mut self, t0: f64, z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure> {
        self.instance.initial_store(t0, z, y, yp)
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.instance.residual(t, y, yp, out);
    }

    fn loop_error(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<LoopError> {
        self.instance.loop_error(t, y, yp)
    }

    fn initial_loop_error(&mut self, t0: f64, z: &[f64]) -> Option<LoopError> {
        self.instance.initial_loop_error(t0, z)
    }

    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        self.instance.jacobian(t, y, yp, state_values, rate_values);
    }

    fn states(&self, out: &mut [bool]) {
        self.instance.states(out);
    }

    fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> StateChoice {
        self.instance.choose_states(t, y, yp)
    }

    fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.instance.roots(t, y, yp, out);
    }

    fn held(&self, out: &mut [bool]) {
        self.instance.held(out);
    }

    fn next_time_event(&mut self, t: f64) -> TimeEvent {
        self.instance.next_time_event(t)
    }

    fn unchanged_until(&mut self, t: f64, until: f64) -> f64 {
        self.instance.unchanged_until(t, until)
    }

    fn event_pass(&mut self, phase: EventPhase, t: f64, y: &mut [f64], yp: &[f64]) -> Result<EventChange, EvalFailure> {
        self.instance.event_pass(phase, t, y, yp)
    }

    fn outputs(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.instance.outputs(t, y, yp, out);
    }

    fn assertions(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>) {
        self.instance.assertions(t, y, yp, out);
    }

    fn delay_bounds(&mut self, out: &mut [f64]) {
        self.instance.delay_bounds(out);
    }

    fn delay_points(&mut self, t: f64, y: &[f64], yp: &[f64], sources: &mut [f64], times: &mut [f64]) {
        self.instance.delay_points(t, y, yp, sources, times);
    }

    fn set_delayed(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        self.instance.set_delayed(values, rates, times);
    }

    fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.instance.set_input(input, series)
    }

    fn input_reach(&mut self, t: f64) -> f64 {
        self.instance.input_reach(t)
    }

    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        self.instance.diagnose(t, y, yp)
    }

    fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure> {
        self.instance.diagnose_initial(t0, z)
    }

    fn tangents(&mut self) -> Option<&mut dyn Tangents> {
        // How these start values move with the parameters that the start finds is not carried along.
        (!self.shared.loaded.model.has_late_starts()).then_some(self)
    }
}
