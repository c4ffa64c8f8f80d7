//! Equation sections: `=`, `for`, `if`, `assert`, and what goes to `when` and `connect`.

use std::sync::Arc;

use hyd_instance::{ScalarType, Scope, Value};
use hyd_source::{Code, Origin, Reported, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::{Arguments, ClassBody, ClassDef, ClassKind, Equation, EquationKind, Expr, ExprKind, Iterator};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;
use crate::model::Section;
use crate::range::Range;

/// What surrounds an equation in the text: loops not yet entered, from the outside in.
#[derive(Clone, Default)]
pub(crate) struct Loops<'e> {
    pub(crate) iterators: Vec<&'e Iterator>,
}

/// How often the values of the counters around an equation are cut into parts, one after the other.
pub(crate) const MOST_CUTS: u32 = 6;

impl Flattener<'_, '_> {
    /// All equation sections of one class of an instance.
    pub(crate) fn class_sections(&mut self, scope: Scope, def: &Arc<ClassDef>) {
        let ClassBody::Long { equations, algorithms, .. } = &def.body else { return };
        if def.kind == ClassKind::Function {
            return;
        }
        for section in algorithms {
            let named = self.tree.parts_in_algorithm(section, scope);
            self.algorithm(named.as_ref().unwrap_or(section), scope);
        }
        for section in equations {
            for equation in &section.equations {
                let named = self.tree.parts_in_equation(equation, scope);
                self.equation(named.as_ref().unwrap_or(equation), scope, &Loops::default(), section.initial);
            }
        }
    }

    pub(crate) fn origin(&mut self, scope: Scope, equation: &Equation) -> Origin {
        Origin { path: self.path(scope.inst), span: equation.span }
    }

    pub(crate) fn equation(&mut self, equation: &Equation, scope: Scope, loops: &Loops<'_>, initial: bool) {
        match &equation.kind {
            EquationKind::Equal(left, right) => self.equal(equation, left, right, scope, loops, initial),
            EquationKind::Connect(a, b) => self.connect(equation.span, a, b, scope, loops),
            EquationKind::For(iterators, body) => {
                let mut inner = loops.clone();
                inner.iterators.extend(iterators);
                for equation in body {
                    self.equation(equation, scope, &inner, initial);
                }
            }
            EquationKind::If(branches) => self.if_equation(equation, branches, scope, loops, initial),
            EquationKind::When(branches) => self.when(equation, branches, scope, loops),
            EquationKind::Call(function, arguments) => {
                let name = function.parts[0].name.name.clone();
                match name.as_ref() {
                    "assert" => self.assertion(equation, arguments, scope, loops),
                    "reinit" | "terminate" => {
                        let message = format!("`{name}` is allowed only inside `when`");
                        let _ = self.error(Code::Misplaced, equation.span, message);
                    }
                    "Connections" => {
                        let message = "overconstrained connections are outside the language profile";
                        let _ = self.error(Code::OutsideProfile, equation.span, message);
                    }
                    _ => {
                        let message = "a call by itself determines nothing here";
                        let _ = self.error(Code::Misplaced, equation.span, message);
                    }
                }
            }
        }
    }

    /// Enters the arrays of components around the scope and the loops of the text.
    pub(crate) fn enter_all(&mut self, cx: &mut Context, loops: &Loops<'_>) -> Result<(), Fail> {
        self.enter(cx);
        self.enter_loops(cx, &loops.iterators)
    }

    /// Enters loops of the text.
    pub(crate) fn enter_loops(&mut self, cx: &mut Context, iterators: &[&Iterator]) -> Result<(), Fail> {
        for iterator in iterators {
            let range = self.range(iterator, cx)?;
            let at = cx.counter(range.count());
            let local = match range {
                Range::Steps { start, step, .. } => {
                    Local::Index(start.add_scaled(&at, step).ok_or(Fail::NeedsExpansion)?)
                }
                Range::Values(values) => {
                    if values.is_empty() {
                        Local::Index(Affine::constant(0))
                    } else {
                        let k = at.as_constant().ok_or(Fail::NeedsExpansion)?;
                        crate::lower::local_of(values.get(k as usize).cloned().ok_or(Fail::Reported)?)
                    }
                }
                Range::Nodes(_) => return Err(Fail::Reported),
            };
            cx.names.push((iterator.name.name.clone(), local));
        }
        Ok(())
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
        if self.equal_records(equation, left, right, scope, loops, initial) {
            return;
        }
        if let ExprKind::Tuple(targets) = &left.kind
            && targets.len() > 1
        {
            self.equal_outputs(equation, targets, right, scope, loops, initial);
            return;
        }
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
            let (a, b) = (flat.lower(left, cx, &index)?, flat.lower(right, cx, &index)?);
            flat.check_sides(equation, left, right, &a, &b)?;
            if !initial {
                flat.check_determines(equation, [left, right], [&a, &b], cx)?;
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

    /// An equation between records is one between their fields; false if these are not records.
    fn equal_records(
        &mut self,
        equation: &Equation,
        left: &Expr,
        right: &Expr,
        scope: Scope,
        loops: &Loops<'_>,
        initial: bool,
    ) -> bool {
        let mut probe = self.context_of(scope);
        // Loop variables are not records, and hide components of their name.
        let hidden = |i: &&Iterator| (i.name.name.clone(), Local::Index(Affine::constant(0)));
        probe.names.extend(loops.iterators.iter().map(hidden));
        let pairs = match self.record_pairs(left, right, &mut probe) {
            Ok(Some(pairs)) => pairs,
            Ok(None) => return false,
            Err(_) => return true,
        };
        for (l, r) in pairs {
            self.equal(equation, &l, &r, scope, loops, initial);
        }
        true
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
        let ExprKind::Call(function, arguments) = &right.kind else {
            let _ = self.error(Code::TypeMismatch, right.span, "several results come only from a function");
            return;
        };
        let origin = self.origin(scope, equation);
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let outputs = flat.call_outputs(right.span, function, arguments, cx)?;
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
            self.tree.check_record(cx.scope, target)?;
            for (name, inner) in fields {
                let part = self.tree.field_of(cx.scope, target, name)?;
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
            self.check_sides(equation, target, right, &a, &b)?;
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

    fn assertion(&mut self, equation: &Equation, arguments: &Arguments, scope: Scope, loops: &Loops<'_>) {
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            flat.guarded_assertion(equation.span, arguments, cx, scope, None)
        });
    }

    /// The arguments of an `assert`, by position or name.
    pub(crate) fn assert_parts(&mut self, span: Span, arguments: &Arguments, scope: Scope) -> Result<Assertion, Fail> {
        let Arguments::List { positional, named } = arguments else {
            return Err(self.error(Code::BadArguments, span, "`assert` takes a condition and a message"));
        };
        let part = |k: usize, name: &str| {
            let by_name = named.iter().find(|(n, _)| n.name.as_ref() == name).map(|(_, e)| e);
            positional.get(k).or(by_name).cloned()
        };
        let unknown = named.iter().find(|(n, _)| !["condition", "message", "level"].contains(&n.name.as_ref()));
        let (Some(condition), Some(text), None) = (part(0, "condition"), part(1, "message"), unknown) else {
            return Err(self.error(Code::BadArguments, span, "`assert` takes a condition and a message"));
        };
        let level = part(2, "level");
        let error = match level.map(|e| self.tree.evaluate(&e, scope, &hyd_instance::Env::default())) {
            Some(Ok(Value::Enumeration(_, k))) => k != 1,
            Some(Err(Reported)) => return Err(Fail::Reported),
            _ => true,
        };
        Ok(Assertion { condition, text, error })
    }
}

/// What an `assert` says.
pub(crate) struct Assertion {
    pub condition: Expr,
    pub text: Expr,
    /// An error, not a warning.
    pub error: bool,
}
