//! Equation sections: `=`, `for`, `if`, `assert`, and what goes to `when` and `connect`.

use std::sync::Arc;

use hyd_instance::{ScalarType, Scope};
use hyd_source::{Code, Origin};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::{self as text, ClassBody, ClassDef, ClassKind};
use hyd_typed::{Equation, EquationKind, Expr};

use crate::model::Section;
use crate::sections::loops::Loops;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, Pass};
use crate::state::index::Affine;
use crate::state::node::Typed;

/// How often the values of the counters around an equation are cut into parts, one after the other.
pub(crate) const MOST_CUTS: u32 = 6;

/// True if a `connect`, or what is said of overdetermined records, stands in the equation.
fn connects(equation: &text::Equation) -> bool {
    match &equation.kind {
        text::EquationKind::Connect(..) => true,
        text::EquationKind::Call(function, _) => hyd_instance::speaks_of_connections(function),
        text::EquationKind::For(_, body) => body.iter().any(connects),
        text::EquationKind::If(branches) => branches.iter().flat_map(|(_, body)| body).any(connects),
        _ => false,
    }
}

impl Flattener<'_, '_> {
    /// All equation sections of one class of an instance.
    pub(crate) fn class_sections(&mut self, scope: Scope, def: &Arc<ClassDef>) {
        let ClassBody::Long { equations, algorithms, .. } = &def.body else { return };
        if def.kind == ClassKind::Function {
            return;
        }
        let read: &[_] = if self.pass == Pass::Equations { algorithms } else { &[] };
        for section in read {
            let named = self.scopes.parts_in_algorithm(section, scope);
            let section = named.as_ref().unwrap_or(section);
            let statements = self.elaborator(scope, None).statements(&section.statements);
            self.algorithm(&statements, section.initial, section.span, scope);
        }
        for section in equations {
            for equation in &section.equations {
                if self.pass == Pass::Connections && !connects(equation) {
                    continue;
                }
                let named = self.scopes.parts_in_equation(equation, scope);
                let typed = self.elaborator(scope, None).equation(named.as_ref().unwrap_or(equation));
                self.equation(&typed, scope, &Loops::default(), section.initial);
            }
        }
    }

    pub(crate) fn origin(&mut self, scope: Scope, equation: &Equation) -> Origin {
        Origin { path: self.path(scope.inst), span: equation.span }
    }

    pub(crate) fn equation(&mut self, equation: &Equation, scope: Scope, loops: &Loops<'_>, initial: bool) {
        let connecting = self.pass == Pass::Connections;
        match &equation.kind {
            EquationKind::Connect(..) | EquationKind::Overdetermined(_) if !connecting => return,
            EquationKind::Connect(..)
            | EquationKind::Overdetermined(_)
            | EquationKind::For(..)
            | EquationKind::If(_) => {}
            _ if connecting => return,
            _ => {}
        }
        match &equation.kind {
            EquationKind::Equal(left, right) => self.equal(equation, left, right, scope, loops, initial),
            EquationKind::Connect(a, b) => self.connect(equation.span, a, b, scope, loops),
            EquationKind::Overdetermined(said) => self.overdetermined(equation.span, said, scope, loops),
            EquationKind::For(iterators, body) => {
                let mut inner = loops.clone();
                inner.iterators.extend(iterators);
                for equation in body {
                    self.equation(equation, scope, &inner, initial);
                }
            }
            EquationKind::If(branches) => self.if_equation(equation, branches, scope, loops, initial),
            EquationKind::When(branches) => self.when(equation, branches, scope, loops),
            EquationKind::Fields(fields) => {
                fields.iter().for_each(|field| self.equation(field, scope, loops, initial));
            }
            EquationKind::Outputs(targets, call) => self.equal_outputs(equation, targets, call, scope, loops, initial),
            EquationKind::Assert(assertion) => {
                let start = self.context_of(scope);
                self.with_loops(start, &mut |flat, cx| {
                    flat.enter_all(cx, loops)?;
                    flat.guarded_assertion(equation.span, assertion, cx, None)
                });
            }
            EquationKind::Call(call) => {
                let start = self.context_of(scope);
                self.with_loops(start, &mut |flat, cx| {
                    flat.enter_all(cx, loops)?;
                    if cx.counts.contains(&0) {
                        return Ok(());
                    }
                    flat.call_for_checks(equation.span, call, cx, true)
                });
            }
            EquationKind::Failed(said) => drop(self.say(said)),
            // Those outside of `when` have no meaning, which has been said.
            EquationKind::Terminate(_) | EquationKind::Reinit(..) => {}
        }
    }

    fn equal(
        &mut self,
        equation: &Equation,
        left: &Expr,
        right: &Expr,
        scope: Scope,
        loops: &Loops<'_>,
        initial: bool,
    ) {
        let origin = self.origin(scope, equation);
        let start = Context { cuts_left: MOST_CUTS, ..self.context_of(scope) };
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            if cx.counts.contains(&0) {
                return Ok(());
            }
            let (l, r) = (flat.shape(left, cx)?, flat.shape(right, cx)?);
            flat.check_same_shape(equation.span, &l, &r)?;
            let index: Vec<Affine> = l.iter().map(|&size| cx.counter(size)).collect();
            if l.contains(&0) {
                return Ok(());
            }
            cx.may_add_variables = !initial;
            let a = flat.lower(left, cx, &index)?;
            // Where a discrete variable starts is computed once: nothing in it is an event.
            cx.no_event |= initial && !matches!(a.scalar, ScalarType::Real);
            let b = flat.lower(right, cx, &index)?;
            flat.check_sides(equation.span, left, right, &a, &b)?;
            if !initial {
                flat.check_determines(equation.span, [left, right], [&a, &b])?;
            }
            let section = flat.section_of(&a, initial);
            flat.emit_equal(section, (a.node, b.node), cx, &index, &origin)?;
            if !initial && (section == Section::Discrete || flat.is_discrete(&a)) {
                flat.note_discrete();
            }
            Ok(())
        });
    }

    /// Emits `left = right`, a continuous one with the terms that are injected into it.
    pub(crate) fn emit_equal(
        &mut self,
        section: Section,
        (left, right): (NodeId, NodeId),
        cx: &mut Context,
        index: &[Affine],
        origin: &Origin,
    ) -> Result<(), Fail> {
        let open = section == Section::Continuous;
        let right = if open { self.injected(right, origin, cx, index)? } else { right };
        let block = self.tables().equations.len();
        self.emit(section, left, right, &cx.loop_counts(), origin);
        let tables = self.tables();
        if open && tables.equations.len() > block {
            tables.notes.injectable.push(block);
        }
        Ok(())
    }

    /// `(a, , b) = f(...)`: each output taken is an equation.
    fn equal_outputs(
        &mut self,
        equation: &Equation,
        targets: &[Option<Expr>],
        right: &Expr,
        scope: Scope,
        loops: &Loops<'_>,
        initial: bool,
    ) {
        let origin = self.origin(scope, equation);
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let outputs = flat.call_outputs(right, cx)?;
            if targets.len() > outputs.len() {
                let message = format!("the function gives {} values, but {} are taken", outputs.len(), targets.len());
                return Err(flat.error(Code::BadArguments, right.span, message));
            }
            for (target, (_, value)) in targets.iter().zip(&outputs) {
                if let Some(target) = target {
                    flat.equal_output(equation, (target, right), value, cx, initial, &origin)?;
                }
            }
            Ok(())
        });
    }

    /// `target = value` for one result of a call: element by element, field by field.
    fn equal_output(
        &mut self,
        equation: &Equation,
        (target, right): (&Expr, &Expr),
        value: &Local,
        cx: &mut Context,
        initial: bool,
        origin: &Origin,
    ) -> Result<(), Fail> {
        if let Local::Record(fields) | Local::Records(fields, _) = value {
            let Some(variable) = target.variable() else {
                let message = "a value of a record must be a record, its constructor, or a function that gives one";
                return Err(self.error(Code::TypeMismatch, target.span, message));
            };
            for (name, inner) in fields {
                let Some(&child) = self.scopes.instances[variable.last()].by_name.get(name) else {
                    return Err(self.no_field(target.span, name));
                };
                let part = self.component_of(target, variable, child);
                self.equal_output(equation, (&part, right), inner, cx, initial, origin)?;
            }
            return Ok(());
        }
        let shape = self.shape(target, cx)?;
        for k in 0..shape.iter().product::<usize>() {
            let mut rest = k;
            let mut at = vec![Affine::constant(0); shape.len()];
            for (position, &size) in shape.iter().enumerate().rev() {
                at[position] = Affine::constant((rest % size) as i64);
                rest /= size;
            }
            let (a, b) = (self.lower(target, cx, &at)?, self.element_of_local(right.span, value, &at)?);
            self.check_sides(equation.span, target, right, &a, &b)?;
            let section = self.section_of(&a, initial);
            self.emit(section, a.node, b.node, &cx.loop_counts(), origin);
        }
        Ok(())
    }

    pub(crate) fn section_of(&self, side: &Typed, initial: bool) -> Section {
        match (&side.scalar, initial) {
            (_, true) => Section::Initial,
            (ScalarType::Real, false) => Section::Continuous,
            // A number literal on the left (`0 = x - y`) says nothing; the other side decides.
            (ScalarType::Integer, false) if self.model.templates.arena.as_constant(side.node).is_some() => {
                Section::Continuous
            }
            _ => Section::Discrete,
        }
    }
}
