//! `sum product min max` of arrays and of `expression for i in range` (Modelica 3.6, section 10.3.4).
//!
//! Long ones become trees of auxiliary variables (`fold`).

use hyd_instance::{Builtin, ScalarType};
use hyd_source::{Code, Span};
use hyd_typed::{Expr, Iterator};

use crate::expressions::fold::Fold;
use crate::expressions::range::Range;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    pub(crate) fn lower_fold(&mut self, builtin: Builtin, array: &Expr, cx: &mut Context) -> Result<Typed, Fail> {
        let shape = self.shape(array, cx)?;
        if shape.is_empty() && matches!(builtin, Builtin::Min | Builtin::Max) {
            let name = builtin.name();
            let message = format!("`{name}` of one argument takes an array, but this is a scalar");
            return Err(self.error(Code::BadArguments, array.span, message));
        }
        let Some(fold) = Fold::of(builtin) else { return Err(Fail::Reported) };
        if let &[total] = shape.as_slice() {
            let mut term =
                |flat: &mut Self, cx: &mut Context, at: &Affine| flat.lower(array, cx, std::slice::from_ref(at));
            if let Some(long) = self.long_fold(fold, total, (array.span, cx), &mut term)? {
                return Ok(long);
            }
        }
        let all = self.elements_of(array, cx)?;
        self.fold(array.span, fold, all)
    }

    pub(crate) fn fold(&mut self, span: Span, fold: Fold, all: Vec<Typed>) -> Result<Typed, Fail> {
        // An order have Booleans and literals of an enumeration, too (Modelica 3.6, section 10.3.4).
        if let (Fold::Min | Fold::Max, Some(first)) = (fold, all.first())
            && !first.is_number()
            && all.iter().all(|value| value.scalar == first.scalar)
        {
            return Ok(self.fold_of_order(fold, all));
        }
        for value in &all {
            self.want_number(span, "this reduction", value)?;
        }
        if fold == Fold::Sum {
            return Ok(self.sum(all));
        }
        let integer = all.iter().all(|v| matches!(v.scalar, ScalarType::Integer));
        let scalar = if integer { ScalarType::Integer } else { ScalarType::Real };
        let mut result = None;
        for value in all {
            let arena = &mut self.model.templates.arena;
            result = Some(match result {
                None => value.node,
                Some(before) => fold.pair(arena, before, value.node),
            });
        }
        match result {
            Some(node) => Ok(Typed { node, scalar }),
            None if fold == Fold::Product => Ok(self.literal(1.0, ScalarType::Integer)),
            None => {
                Err(self.error(Code::ArrayShape, span, format!("`{}` of an empty array has no value", fold.name())))
            }
        }
    }

    /// The least or largest of Booleans, or of literals of one enumeration; there is at least one.
    fn fold_of_order(&mut self, fold: Fold, all: Vec<Typed>) -> Typed {
        let scalar = all[0].scalar.clone();
        let mut nodes = all.into_iter().map(|value| value.node);
        let first = nodes.next().expect("invariant: called with at least one element");
        let arena = &mut self.model.templates.arena;
        let node = nodes.fold(first, |before, next| match (&scalar, fold) {
            (ScalarType::Boolean, Fold::Max) => arena.or(before, next),
            (ScalarType::Boolean, _) => arena.and(before, next),
            _ => fold.pair(arena, before, next),
        });
        Typed { node, scalar }
    }

    pub(crate) fn lower_reduction(
        &mut self,
        span: Span,
        builtin: Builtin,
        body: &Expr,
        iterators: &[Iterator],
        cx: &mut Context,
    ) -> Result<Typed, Fail> {
        let Some(fold) = Fold::of(builtin) else { return Err(Fail::Reported) };
        if let Some(long) = self.long_reduction(span, fold, body, iterators, cx)? {
            return Ok(long);
        }
        let mark = cx.names.len();
        let mut all = Vec::new();
        let result = self.collect_terms(body, iterators, cx, &mut all);
        cx.names.truncate(mark);
        result?;
        self.fold(span, fold, all)
    }

    /// A reduction over one long range of numbers.
    pub(crate) fn long_reduction(
        &mut self,
        span: Span,
        fold: Fold,
        body: &Expr,
        iterators: &[Iterator],
        cx: &mut Context,
    ) -> Result<Option<Typed>, Fail> {
        let [iterator] = iterators else { return Ok(None) };
        let range = self.range(iterator, cx)?;
        let Range::Steps { start, step, .. } = &range else { return Ok(None) };
        let mut term = |flat: &mut Self, cx: &mut Context, at: &Affine| {
            let value = start.add_scaled(at, *step).ok_or(Fail::NeedsExpansion)?;
            cx.names.push((iterator.name.name.clone(), Local::Index(value)));
            let result = flat.lower(body, cx, &[]);
            cx.names.pop();
            result
        };
        self.long_fold(fold, range.count(), (span, cx), &mut term)
    }

    pub(crate) fn collect_terms(
        &mut self,
        body: &Expr,
        iterators: &[Iterator],
        cx: &mut Context,
        all: &mut Vec<Typed>,
    ) -> Result<(), Fail> {
        let Some((iterator, rest)) = iterators.split_first() else {
            all.push(self.lower(body, cx, &[])?);
            return Ok(());
        };
        let range = self.range(iterator, cx)?;
        if range.count() > crate::expressions::lower::MAX_TERMS {
            let message = format!("more than {} terms", crate::expressions::lower::MAX_TERMS);
            return Err(self.error(Code::Limit, body.span, message));
        }
        for k in 0..range.count() {
            let local = range.local(k)?;
            cx.names.push((iterator.name.name.clone(), local));
            let result = self.collect_terms(body, rest, cx, all);
            cx.names.pop();
            result?;
        }
        Ok(())
    }
}
