//! Variables that the branches of an `if` in a `when` set in different pieces: `g[{1, 3}]` and `g[{2, 4}]` here, `g` there.
//!
//! What sets one variable is found by what is written on the left.  Where pieces of one variable are written differently and share
//! elements, each element is a variable of its own.  Subscripts must be known before the run and name no counter of a loop.

use hyd_instance::Scope;
use hyd_source::Origin;
use hyd_symbolic::Node;
use hyd_typed::{Equation, EquationKind, Expr};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::model::{Section, VarId};
use crate::sections::if_equation::positions;
use crate::sections::when_parts::{Target, Whole};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};

impl Flattener<'_, '_> {
    /// True if all branches set the same elements, however they are written.
    pub(super) fn sets_same_elements(&mut self, branches: &[(Option<Expr>, Vec<Equation>)], scope: Scope) -> bool {
        self.elements_of_all(branches, scope).is_some()
    }

    /// The elements that each of these branches sets; none where they differ or that cannot be said.
    fn elements_of_all(
        &mut self,
        branches: &[(Option<Expr>, Vec<Equation>)],
        scope: Scope,
    ) -> Option<FxHashSet<VarId>> {
        if branches.iter().all(|(condition, _)| condition.is_some()) {
            return None;
        }
        let mut all: Option<FxHashSet<VarId>> = None;
        for (_, body) in branches {
            let mut set = FxHashSet::default();
            for equation in body {
                match &equation.kind {
                    EquationKind::Equal(left, _) => set.extend(self.elements_set(left.bare(), scope)?),
                    EquationKind::If(inner) => set.extend(self.elements_of_all(inner, scope)?),
                    _ => return None,
                }
            }
            match &all {
                Some(known) if *known != set => return None,
                _ => all = Some(set),
            }
        }
        all
    }

    /// The elements that a left side names, in its order; none where that cannot be said.
    fn elements_set(&mut self, left: &Expr, scope: Scope) -> Option<Vec<VarId>> {
        left.variable()?;
        let slots = std::mem::take(&mut self.slots);
        let mut cx = Context { in_when: true, ..self.context_of(scope) };
        let found = self.quietly(|flat| {
            let shape = flat.shape(left, &mut cx)?;
            positions(&shape).map(|at| flat.element_at(left, &mut cx, &at)).collect::<Result<Vec<_>, Fail>>()
        });
        self.slots = slots;
        found.ok()?.into_iter().collect()
    }

    fn element_at(&mut self, left: &Expr, cx: &mut Context, at: &[Affine]) -> Result<Option<VarId>, Fail> {
        let value = self.lower(left, cx, at)?;
        let Node::Slot(slot) = self.model.templates.arena.node(value.node) else { return Ok(None) };
        Ok(match &self.slots.keys[slot.0 as usize] {
            SlotKey::Variable(Kind::Var, first, offset) => {
                offset.as_constant().and_then(|k| u32::try_from(k).ok()).map(|k| VarId(first.0 + k))
            }
            _ => None,
        })
    }

    /// Targets that share elements with others, with the elements of each, and all others.
    pub(super) fn sharing_elements<'e>(
        &mut self,
        targets: Vec<Target<'e>>,
        scope: Scope,
    ) -> (Vec<(Target<'e>, Vec<VarId>)>, Vec<Target<'e>>) {
        let mut pieces: FxHashMap<_, usize> = FxHashMap::default();
        for target in &targets {
            *pieces.entry(target.variable.last()).or_default() += 1;
        }
        let mut elements: Vec<Option<Vec<VarId>>> = Vec::new();
        let mut times: FxHashMap<VarId, usize> = FxHashMap::default();
        for target in &targets {
            let several = pieces[&target.variable.last()] > 1 && target.loops.is_empty();
            let own = if several { self.elements_set(target.left, scope) } else { None };
            for &v in own.iter().flatten() {
                *times.entry(v).or_default() += 1;
            }
            elements.push(own);
        }
        let (mut mixed, mut plain) = (Vec::new(), Vec::new());
        for (target, own) in targets.into_iter().zip(elements) {
            match own {
                Some(own) if own.iter().any(|v| times[v] > 1) => mixed.push((target, own)),
                _ => plain.push(target),
            }
        }
        (mixed, plain)
    }

    /// One equation for each element of such targets.
    pub(super) fn when_elements(&mut self, targets: &[(Target<'_>, Vec<VarId>)], whole: Whole<'_>) {
        let mut done: FxHashSet<VarId> = FxHashSet::default();
        for (target, elements) in targets {
            let last = target.variable.last();
            if target.variable.is_whole() && self.set_before(last, target) {
                return;
            }
            self.make_discrete(last);
            for &v in elements {
                if done.insert(v) {
                    self.when_element(v, targets, target, whole);
                }
            }
        }
    }

    fn when_element(&mut self, v: VarId, targets: &[(Target<'_>, Vec<VarId>)], first: &Target<'_>, whole: Whole<'_>) {
        let origin = Origin { path: self.path(whole.scope.inst), span: first.span };
        let start = Context { in_when: true, ..self.context_of(whole.scope) };
        self.with_loops(start, &mut |flat, cx| {
            let (fires, _) = flat.enter_part(cx, whole, &[])?;
            let mut sides = None;
            let setting = targets.iter().filter(|(_, elements)| elements.contains(&v));
            let given: Vec<_> = setting.flat_map(|(target, _)| &target.values).collect();
            flat.want_one(first.left, &given, cx)?;
            for (target, elements) in targets.iter().rev() {
                let Some(k) = elements.iter().position(|&element| element == v) else { continue };
                let shape = flat.shape(target.left, cx)?;
                let Some(index) = positions(&shape).nth(k) else { continue };
                let left = flat.lower(target.left, cx, &index)?;
                let (_, mut right) = match sides {
                    Some(sides) => sides,
                    None => {
                        let pre = flat.slots.slot(SlotKey::Variable(Kind::Pre, v, Affine::constant(0)));
                        (left.node, flat.model.templates.arena.slot(pre))
                    }
                };
                let loops = cx.counts.len();
                for given in target.values.iter().rev() {
                    right = flat.when_given(given, (target.left, &left), (&fires, right), cx, (loops, &index))?;
                }
                sides = Some((left.node, right));
            }
            if let Some((left, right)) = sides {
                flat.emit(Section::Discrete, left, right, &cx.loop_counts(), &origin);
            }
            Ok(())
        });
    }
}
