//! What happens inside `when`: variables that are set, `reinit`, `assert`, `terminate`, also below `for` and `if`.
//!
//! The body of each branch is taken apart into parts, each with the loops and conditions around it.  What sets one variable in
//! several branches becomes one equation; in a branch a variable that no condition reaches keeps its value.

use hyd_instance::Scope;
use hyd_source::{Code, Diagnostic, Origin};
use hyd_typed::{Equation, EquationKind, Expr, Iterator, Kind as Form};

use crate::functions::draw::AtEvent;
use crate::model::Section;
use crate::sections::loops::Loops;
use crate::sections::when_condition::{WhenCondition, printed};
use crate::sections::when_parts::{Given, Guard, Part, Target, Whole};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};

impl Flattener<'_, '_> {
    pub(crate) fn when_body(
        &mut self,
        equation: &Equation,
        branches: &[(Expr, Vec<Equation>)],
        conditions: &[Vec<WhenCondition>],
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        let mut parts = Vec::new();
        for (branch, (_, body)) in branches.iter().enumerate() {
            let start = Part { equation, branch, loops: Vec::new(), guards: Vec::new() };
            if self.parts(body, &start, scope, &mut parts).is_err() {
                return;
            }
        }
        let whole = Whole { conditions, scope, loops };
        for part in &parts {
            self.when_action(part, whole);
        }
        let targets = self.when_targets(&parts);
        let (mixed, plain) = self.sharing_elements(targets, scope);
        for target in plain {
            self.when_assignment(&target, whole);
        }
        self.when_elements(&mixed, whole);
    }

    /// The equations below `for` and `if`.
    fn parts<'e>(
        &mut self,
        body: &'e [Equation],
        around: &Part<'e>,
        scope: Scope,
        parts: &mut Vec<Part<'e>>,
    ) -> Result<(), Fail> {
        for equation in body {
            match &equation.kind {
                EquationKind::Equal(..)
                | EquationKind::Outputs(..)
                | EquationKind::Assert(_)
                | EquationKind::Terminate(_)
                | EquationKind::Call(_)
                | EquationKind::Reinit(..) => parts.push(Part { equation, ..around.clone() }),
                EquationKind::Fields(fields) => self.parts(fields, around, scope, parts)?,
                EquationKind::Failed(said) => drop(self.say(said)),
                EquationKind::For(iterators, inner) => {
                    let mut inside = around.clone();
                    inside.loops.extend(iterators);
                    self.parts(inner, &inside, scope, parts)?;
                }
                EquationKind::If(branches) => self.if_parts(equation, branches, around, scope, parts)?,
                EquationKind::When(_) | EquationKind::Connect(..) | EquationKind::Overdetermined(_) => {
                    let what = match equation.kind {
                        EquationKind::When(_) => "`when`",
                        EquationKind::Connect(..) => "`connect`",
                        _ => "`Connections`",
                    };
                    let message = format!("{what} is not allowed inside `when`");
                    return Err(self.error(Code::Misplaced, equation.span, message));
                }
            }
        }
        Ok(())
    }

    fn if_parts<'e>(
        &mut self,
        equation: &Equation,
        branches: &'e [(Option<Expr>, Vec<Equation>)],
        around: &Part<'e>,
        scope: Scope,
        parts: &mut Vec<Part<'e>>,
    ) -> Result<(), Fail> {
        let conditions: Vec<&'e Expr> = branches.iter().filter_map(|(c, _)| c.as_ref()).collect();
        let known = conditions.iter().all(|c| self.known_before_run(c));
        let mut sets: Vec<Vec<String>> = Vec::new();
        for (k, (condition, body)) in branches.iter().enumerate() {
            let mut inside = around.clone();
            inside.guards.push(Guard { earlier: conditions[..k].to_vec(), own: condition.as_ref() });
            let mark = parts.len();
            self.parts(body, &inside, scope, parts)?;
            let mut set: Vec<String> = parts[mark..].iter().flat_map(|part| lefts(part.equation)).collect();
            set.sort();
            set.dedup();
            sets.push(set);
        }
        if branches.iter().all(|(c, _)| c.is_some()) {
            sets.push(Vec::new());
        }
        if !known
            && let Some(other) = sets.iter().find(|set| **set != sets[0])
            && !self.sets_same_elements(branches, scope)
        {
            let lacking = sets[0].iter().find(|name| !other.contains(name));
            let name = lacking.or_else(|| other.iter().find(|name| !sets[0].contains(name)));
            let name = name.map_or("", String::as_str);
            let message = format!(
                "the branches of an `if` that is decided during the run must set the same variables, but not all set `{name}`"
            );
            self.report(
                Diagnostic::error(Code::Unbalanced, message)
                    .at(equation.span, "")
                    .help(format!("`{name} = pre({name})` keeps the value")),
            );
            return Err(Fail::Reported);
        }
        Ok(())
    }

    /// `reinit`, `assert`, `terminate`; other equations are gathered by `when_targets`.
    fn when_action(&mut self, part: &Part<'_>, whole: Whole<'_>) {
        let start = Context { in_when: true, ..self.context_of(whole.scope) };
        let (span, scope) = (part.equation.span, whole.scope);
        match &part.equation.kind {
            EquationKind::Reinit(state, value) => self.reinit(part, state, value, whole),
            EquationKind::Terminate(text) => {
                let origin = Origin { path: self.path(scope.inst), span };
                self.with_loops(start, &mut |flat, cx| {
                    let (fires, empty) = flat.enter_part(cx, whole, &part.loops)?;
                    if empty {
                        return Ok(());
                    }
                    let acts = flat.guarded(fires[part.branch], &part.guards, cx)?;
                    let (message, values) = flat.message(text, cx, false)?;
                    let values = flat.message_values(message, &values, cx)?;
                    flat.emit(Section::Terminate(message), acts, values, &cx.loop_counts(), &origin);
                    Ok(())
                });
            }
            EquationKind::Assert(assertion) => self.with_loops(start, &mut |flat, cx| {
                let (fires, empty) = flat.enter_part(cx, whole, &part.loops)?;
                if empty {
                    return Ok(());
                }
                let acts = flat.guarded(fires[part.branch], &part.guards, cx)?;
                flat.guarded_assertion(span, assertion, cx, Some(acts))
            }),
            EquationKind::Call(call) => self.with_loops(start, &mut |flat, cx| {
                let (_, empty) = flat.enter_part(cx, whole, &part.loops)?;
                if empty { Ok(()) } else { flat.call_for_checks(span, call, cx, false) }
            }),
            _ => {}
        }
    }

    fn reinit(&mut self, part: &Part<'_>, state: &Expr, value: &Expr, whole: Whole<'_>) {
        if self.is_no_state(state) {
            return;
        }
        let origin = Origin { path: self.path(whole.scope.inst), span: part.equation.span };
        let start = Context { in_when: true, ..self.context_of(whole.scope) };
        self.with_loops(start, &mut |flat, cx| {
            let (fires, empty) = flat.enter_part(cx, whole, &part.loops)?;
            if empty {
                return Ok(());
            }
            let shape = flat.shape(state, cx)?;
            let acts = flat.guarded(fires[part.branch], &part.guards, cx)?;
            let event = AtEvent::new(acts, cx);
            let index: Vec<Affine> = shape.iter().map(|&size| cx.counter(size)).collect();
            let target = flat.lower(state, cx, &index)?;
            cx.event = Some(event);
            let rank = flat.shape(value, cx)?.len();
            let new = flat.lower(value, cx, if rank == 0 { &[] } else { &index })?;
            flat.want_number(value.span, "`reinit`", &new)?;
            let right = flat.model.templates.arena.select(acts, new.node, target.node);
            flat.emit(Section::Reinit, target.node, right, &cx.loop_counts(), &origin);
            Ok(())
        });
    }

    /// The variables set by `v = e`.
    fn when_targets<'e>(&mut self, parts: &[Part<'e>]) -> Vec<Target<'e>> {
        let mut targets: Vec<Target<'e>> = Vec::new();
        for part in parts {
            match &part.equation.kind {
                EquationKind::Equal(left, right) => self.when_target(left.bare(), (right, None), part, &mut targets),
                EquationKind::Outputs(list, call) => {
                    for (n, piece) in list.iter().enumerate() {
                        if let Some(piece) = piece {
                            self.when_target(piece, (call, Some(n)), part, &mut targets);
                        }
                    }
                }
                _ => {}
            }
        }
        targets
    }

    /// Notes that a part sets `left`.
    fn when_target<'e>(
        &mut self,
        left: &'e Expr,
        value: (&'e Expr, Option<usize>),
        part: &Part<'e>,
        targets: &mut Vec<Target<'e>>,
    ) {
        let Form::Variable(variable) = &left.kind else {
            let message = "inside `when` the left side must be a variable";
            let _ = self.error(Code::Misplaced, left.span, message);
            return;
        };
        let text = |left: &Expr, loops: &[&Iterator]| {
            let ranges = loops.iter().map(|i| format!(" for {} in {}", i.name.name, printed(&i.range)));
            printed(left) + &ranges.collect::<String>()
        };
        let wanted = text(left, &part.loops);
        let given = Given { branch: part.branch, guards: part.guards.clone(), value };
        match targets.iter_mut().find(|t| text(t.left, &t.loops) == wanted) {
            Some(target) => target.values.push(given),
            None => targets.push(Target {
                left,
                variable,
                loops: part.loops.clone(),
                values: vec![given],
                span: part.equation.span,
            }),
        }
    }

    fn when_assignment(&mut self, target: &Target<'_>, whole: Whole<'_>) {
        let last = target.variable.last();
        if target.variable.is_whole() && self.set_before(last, target) {
            return;
        }
        self.make_discrete(last);
        let origin = Origin { path: self.path(whole.scope.inst), span: target.span };
        let start = Context { in_when: true, ..self.context_of(whole.scope) };
        self.with_loops(start, &mut |flat, cx| {
            let (fires, empty) = flat.enter_part(cx, whole, &target.loops)?;
            if empty {
                return Ok(());
            }
            let loops = cx.counts.len();
            let shape = flat.shape(target.left, cx)?;
            let index: Vec<Affine> = shape.iter().map(|&size| cx.counter(size)).collect();
            let left = flat.lower(target.left, cx, &index)?;
            let hyd_symbolic::Node::Slot(slot) = flat.model.templates.arena.node(left.node) else {
                return Err(flat.error(Code::Misplaced, target.span, "only variables can be set inside `when`"));
            };
            let SlotKey::Variable(_, first, offset) = flat.slots.keys[slot.0 as usize].clone() else {
                return Err(Fail::Reported);
            };
            let pre = flat.slots.slot(SlotKey::Variable(Kind::Pre, first, offset));
            let mut right = flat.model.templates.arena.slot(pre);
            flat.want_one(target.left, &target.values.iter().collect::<Vec<_>>(), cx)?;
            for given in target.values.iter().rev() {
                right = flat.when_given(given, (target.left, &left), (&fires, right), cx, (loops, &index))?;
            }
            flat.emit(Section::Discrete, left.node, right, &cx.loop_counts(), &origin);
            Ok(())
        });
    }
}

/// The variables on the left of an equation, as text.
fn lefts(equation: &Equation) -> Vec<String> {
    match &equation.kind {
        EquationKind::Equal(left, _) => vec![printed(left.bare())],
        EquationKind::Outputs(list, _) => list.iter().flatten().map(printed).collect(),
        _ => Vec::new(),
    }
}
