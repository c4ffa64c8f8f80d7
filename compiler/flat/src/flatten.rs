//! The flattener: instances to variables, bindings and equations.
//!
//! Order: variables of all instances, then what is connected, then their bindings and start values, then the equation sections, then the
//! equations of connections, and at the end the values from outside that all this has asked for.

use std::sync::Arc;

use hyd_instance::{InstId, InstanceTree, Scope, Scopes};
use hyd_source::Outcome;
use hyd_syntax::tree::ClassKind;
use hyd_typed::Typing;
use rustc_hash::FxHashMap;

use crate::connections::connect::Connections;
use crate::connections::virtual_graph::VirtualGraph;
use crate::model::FlatModel;
use crate::sections::inject::Injection;
use crate::state::draft::Notes;
use crate::state::flattener::{Flattener, Pass};
use crate::state::index::Slots;

/// Turns the instance tree into a flat model, as complete as it can be, with terms added to equations.  Names mean what `scopes` says,
/// which come with the tree from [`hyd_instance::instantiate`].
///
/// Inputs of the model itself whose names stand in `driven` follow recorded samples.  What is not the name of an input of type Real
/// stays without effect; [`FlatModel::driven`] says which there are.
pub fn flatten(
    tree: &InstanceTree,
    scopes: &mut Scopes<'_>,
    terms: &[Injection],
    driven: &[String],
) -> Outcome<FlatModel> {
    scopes.table.messages.begin();
    let value = Flattener::new(tree, scopes, driven).model_of(terms, |_| {});
    Outcome { value, diagnostics: scopes.table.messages.end() }
}

impl<'t, 's> Flattener<'t, 's> {
    fn new(tree: &'t InstanceTree, scopes: &'t mut Scopes<'s>, driven: &[String]) -> Self {
        let root = &tree.components[tree.root];
        let name: Arc<str> = root.class.map(|c| scopes.table.full_name(c)).unwrap_or_default().into();
        Flattener {
            model: FlatModel { name, description: root.description.clone(), ..FlatModel::default() },
            tree,
            scopes,
            blocks: FxHashMap::default(),
            in_streams: FxHashMap::default(),
            notes: Notes::default(),
            drafts: Vec::new(),
            slots: Slots::default(),
            asked: Vec::new(),
            statements: 0,
            connections: Connections::default(),
            graph: VirtualGraph::default(),
            records: FxHashMap::default(),
            lowering: 0,
            lowered: 0,
            too_many_operands: false,
            late: FxHashMap::default(),
            builders: Vec::new(),
            bodies: Vec::new(),
            opaque_at: root.span,
            injections: Vec::new(),
            quantities: FxHashMap::default(),
            function_units: FxHashMap::default(),
            is_component: false,
            range_checks: FxHashMap::default(),
            clock_around: None,
            tables_known: Vec::new(),
            lists_known: Default::default(),
            pass: Pass::Connections,
            numbers: FxHashMap::default(),
            canonical: FxHashMap::default(),
            driven: driven.to_vec(),
            driven_instances: Vec::new(),
            foreign: Vec::new(),
            functions: Flattener::call_outputs,
            typing: Typing::default(),
            paths: FxHashMap::default(),
            draws_met: FxHashMap::default(),
            drawn: 0,
        }
    }

    /// The flat model; `before_sections` is called when variables and bindings are there.
    fn model_of(mut self, terms: &[Injection], before_sections: impl FnOnce(&mut Self)) -> FlatModel {
        self.read_experiment();
        self.prepare_injections(terms);
        self.settle_inputs_of_the_model();
        self.settle_foreign_blocks();
        let root = self.tree.root;
        self.declare(root);
        self.note_ends();
        self.note_foreign_blocks();
        self.drive_inputs();
        // What is connected is known before any equation asks for it.
        self.sections(root, Pass::Connections);
        self.scopes.found.connected = Some(self.connections.counted());
        self.settle_virtual_graph();
        let variables: Vec<InstId> = self.variable_instances();
        for &inst in &variables {
            self.attributes(inst);
            self.bind(inst);
        }
        let bindings = self.model.equations.len();
        before_sections(&mut self);
        self.sections(root, Pass::Equations);
        self.settle_draws();
        self.check_injections();
        let sections = self.model.equations.len();
        self.connect_all();
        self.equality_constraints();
        self.note_potentials();
        self.note_terminals();
        self.note_gaps();
        self.check_ends();
        self.balance_components(bindings, sections);
        if !self.model.open_inputs.is_empty() {
            self.note_unread_outputs();
        }
        let noted = self.notes.discrete.clone();
        self.let_records_follow(&noted);
        self.check_discrete_time();
        self.check_before_event();
        self.take_given_values();
        self.take_given_texts();
        self.settle();
        if self.is_for_other_tools() {
            self.note_texts();
        }
        let injectable = self.notes.injectable.iter().map(|&at| at as u32).collect();
        let clocked = self.notes.clocked.iter().map(|&(at, clock, count)| (at as u32, clock, count)).collect();
        FlatModel { injectable, clocked, ..self.model }
    }
}

impl Flattener<'_, '_> {
    fn read_experiment(&mut self) {
        let Some(class) = self.scopes.instances[self.tree.root].class else { return };
        let def = self.scopes.table.class(class).def.clone();
        let Some(annotation) = &def.annotation else { return };
        let tree = hyd_instance::modifier::AstMod::from_syntax(annotation);
        let Some((_, experiment)) = tree.children.iter().find(|(n, _)| n.as_ref() == "experiment") else { return };
        let scope = Scope { inst: self.tree.root, frame: 0 };
        for (name, entry) in &experiment.children {
            let Some(expr) = &entry.binding else { continue };
            let Ok(value) = self.scopes.evaluate(expr, scope, &hyd_instance::Env::default()) else { continue };
            let Some(number) = value.as_real().filter(|x| x.is_finite()) else { continue };
            match name.as_ref() {
                "StartTime" => self.model.experiment.start = Some(number),
                "StopTime" => self.model.experiment.stop = Some(number),
                "Tolerance" => self.model.experiment.tolerance = Some(number),
                "Interval" => self.model.experiment.interval = Some(number),
                _ => {}
            }
        }
    }

    /// Equation sections of an instance and all below it.
    fn sections(&mut self, inst: InstId, pass: Pass) {
        self.pass = pass;
        if self.scopes.instances[inst].absent {
            return;
        }
        if let (Some(shape), false) =
            (self.scopes.instances[inst].shape.clone(), self.scopes.instances[inst].kind == ClassKind::Package)
        {
            for frame in 0..shape.frames.len() {
                let def = shape.def(&self.scopes.table, frame as u32).clone();
                self.class_sections(Scope { inst, frame: frame as u32 }, &def);
            }
        }
        for child in self.scopes.instances[inst].children.clone() {
            self.sections(child, pass);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sections::inject::TermShape;
    use hyd_instance::{ClassTable, SourceText, Sources};

    struct NoLibraries;

    impl Sources for NoLibraries {
        fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    const TEXTS: [&str; 4] = [
        "model M Real x[9](each start = 1, each fixed = true); Real y[3]; Real z[2]; discrete Integer n(start = 0);
        equation der(x) = -x;
        for k in 1:3 loop y[k] = delay(x[k*k], 0.1) + floor(3*x[k]); end for;
        for k in 1:2 loop z[k] = if k > 1 then (if sample(0, k) then 1 else 2) else der(y[k]); end for;
        when x[1] < 0.5 then n = pre(n) + 1; end when;
        assert(x[1] > 0, \"below zero\"); end M;",
        "function f input Real u(unit = \"m\"); output Real y[3]; algorithm for k in 1:3 loop y[k] := k*u; end for; end f;
        model M Real x(unit = \"m\") = 2*time; Real y[3] = f(x); Real s; Real w[50];
        equation w = fill(time, 50); s = sum(w[k]^2 for k in 1:50); end M;",
        "model M Real x(start = 1, fixed = true); Boolean b; discrete Real h;
        equation der(x) = if b then -x else sin(time); b = x > 0.5;
        when {b, time > 2} then h = x; reinit(x, 1); end when; end M;",
        "model M Real x; Real y[2];
        equation x = unknown + 1; y[3] = f(2); when x > 1 then y[1] = x; end when; when x > 2 then y[1] = x; end when; end M;",
    ];

    fn shown(text: &str, rehearse: bool) -> String {
        let mut sources = NoLibraries;
        let mut table = ClassTable::new(&mut sources);
        let class = *table.add_main("m.hyd", text).last().expect("a class");
        let (tree, mut scopes) =
            hyd_instance::instantiate(table, class, Vec::new()).ok().expect("it can be instantiated");
        let shape = TermShape::Expression("x[if true then 1 else 2]".into());
        let term = Injection { path: "".into(), file: None, line: 2, name: "extra".into(), shape };
        let model = Flattener::new(&tree, &mut scopes, &[]).model_of(&[term], |flat| {
            if rehearse {
                let known = (std::mem::take(&mut flat.connections), std::mem::take(&mut flat.graph));
                flat.quietly(|flat| {
                    flat.sections(flat.tree.root, Pass::Connections);
                    flat.sections(flat.tree.root, Pass::Equations);
                });
                (flat.connections, flat.graph) = known;
            }
        });
        let FlatModel { variables, equations, delays, messages, claims, injectable, scalars, .. } = &model;
        let made = format!("{variables:#?}{equations:#?}{delays:?}{messages:?}{claims:#?}{injectable:?}{scalars}");
        format!("{made}{:?}{:#?}", model.constants, scopes.table.messages.into_given())
    }

    /// All sections, lowered as an attempt that is dropped before they are lowered for good, change nothing: no variable, no
    /// equation, no number, no message.
    #[test]
    fn a_dropped_attempt_leaves_no_trace() {
        for text in TEXTS {
            let (once, rehearsed) = (shown(text, false), shown(text, true));
            for (a, b) in once.lines().zip(rehearsed.lines()) {
                assert_eq!(a, b, "{text}");
            }
            assert_eq!(once.len(), rehearsed.len());
        }
    }
}
