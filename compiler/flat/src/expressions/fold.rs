//! Long sums, products, minima and maxima in pieces of bounded length.
//!
//! A fold over N elements written into one expression would be a template that grows with N.  Beyond [`LONGEST`] elements it
//! becomes a tree of auxiliary variables, each the fold of [`PIECE`] others: the equations of one level are one loop over one
//! template, and no row of the system gets long (pairwise summation, Higham 2002, "Accuracy and Stability of Numerical
//! Algorithms", section 4.2, also bounds the rounding error).  Upper levels are filled up with the neutral element, so the
//! templates do not depend on N.  Where an expression is not always evaluated (a branch of `if`), in functions, `when`
//! and at translation, folds stay one expression.

use hyd_instance::{Builtin, ScalarType};
use hyd_source::{Origin, Span};
use hyd_symbolic::{Arena, Function, NodeId, SlotId};
use hyd_system::{ValueKind, Variability};

use crate::model::{EquationBlock, Operand, Section, Target, VarId};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, CounterId, Kind, SlotKey};
use crate::state::made::Made;
use crate::state::node::Typed;

/// Folds over more elements are cut into pieces.
pub(crate) const LONGEST: usize = 32;
/// Elements of a piece.
const PIECE: usize = 8;

/// An associative operation over the elements of an array.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Fold {
    /// `sum`
    Sum,
    /// `product`
    Product,
    /// `min`
    Min,
    /// `max`
    Max,
}

impl Fold {
    /// The operation of a function of the language.
    pub(crate) fn of(builtin: Builtin) -> Option<Self> {
        Some(match builtin {
            Builtin::Sum => Fold::Sum,
            Builtin::Product => Fold::Product,
            Builtin::Min => Fold::Min,
            Builtin::Max => Fold::Max,
            _ => return None,
        })
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Fold::Sum => "sum",
            Fold::Product => "product",
            Fold::Min => "min",
            Fold::Max => "max",
        }
    }

    /// The element that changes nothing (finite, so that a derivative may multiply it by zero).
    fn neutral(self) -> f64 {
        match self {
            Fold::Sum => 0.0,
            Fold::Product => 1.0,
            Fold::Min => f64::MAX,
            Fold::Max => f64::MIN,
        }
    }

    /// Of two.
    pub(crate) fn pair(self, arena: &mut Arena, a: NodeId, b: NodeId) -> NodeId {
        match self {
            Fold::Sum => arena.add(a, b),
            Fold::Product => arena.mul(a, b),
            Fold::Min => arena.call2(Function::Min, a, b),
            Fold::Max => arena.call2(Function::Max, a, b),
        }
    }

    /// The fold of some nodes as a balanced tree, the neutral element for none.
    pub(crate) fn combine(self, arena: &mut Arena, mut nodes: Vec<NodeId>) -> NodeId {
        while nodes.len() > 1 {
            let pairs = nodes.chunks(2);
            nodes = pairs.map(|two| if let [a, b] = two { self.pair(arena, *a, *b) } else { two[0] }).collect();
        }
        nodes.first().copied().unwrap_or_else(|| arena.constant(self.neutral()))
    }
}

/// An element of a fold at a position (from 0, affine in the counters).
pub(crate) type Term<'t, 's, 'f> =
    &'f mut dyn FnMut(&mut Flattener<'t, 's>, &mut Context, &Affine) -> Result<Typed, Fail>;

impl<'t, 's> Flattener<'t, 's> {
    /// A fold over many elements as a variable of its own; none where it is short or may not be taken apart.
    pub(crate) fn long_fold(
        &mut self,
        fold: Fold,
        total: usize,
        (span, cx): (Span, &Context),
        term: Term<'t, 's, '_>,
    ) -> Result<Option<Typed>, Fail> {
        if total <= LONGEST || !cx.may_add_variables || cx.depth > 0 {
            return Ok(None);
        }
        let outer = std::mem::take(&mut self.slots);
        let (made, draft) = self.attempt(|flat| flat.fold_pieces(fold, total, span, cx, term));
        self.slots = outer;
        match made {
            Ok(Some((first, strides))) => {
                self.keep(draft);
                let slot = self.slots.slot(SlotKey::Variable(Kind::Var, first, strides));
                Ok(Some(Typed::real(self.model.templates.arena.slot(slot))))
            }
            // The elements need the counters one after the other: the usual way finds that out and says so.
            Ok(None) | Err(Fail::NeedsExpansion | Fail::Split(..) | Fail::Opaque) => Ok(None),
            Err(Fail::Reported) => {
                self.keep(draft);
                Err(Fail::Reported)
            }
        }
    }

    /// The number of a fold that is taken apart.
    fn next_fold(&mut self) -> u32 {
        self.tables().notes.folds += 1;
        self.all_notes().map(|notes| notes.folds).sum()
    }

    /// The first of the variables that hold the results, one per value of the counters around, and how they are counted.
    fn fold_pieces(
        &mut self,
        fold: Fold,
        total: usize,
        span: Span,
        cx: &Context,
        term: Term<'t, 's, '_>,
    ) -> Result<Option<(VarId, Affine)>, Fail> {
        let around = cx.loop_counts();
        // Each element is an operand of a piece at least.
        self.check_operands(&around, total, span)?;
        let rows: usize = around.iter().product();
        let (full, rest) = (total / PIECE, total % PIECE);
        // The elements of a fold belong together.
        let cx = &Context { cuts_left: 0, ..cx.clone() };
        let mut inner = cx.clone();
        let piece = inner.counter(full);
        let Some(start) = Affine::constant(0).add_scaled(&piece, PIECE as i64) else { return Ok(None) };
        let Some(full_value) = self.fold_terms(fold, PIECE, &start, &mut inner, term)? else { return Ok(None) };
        let full_slots = std::mem::take(&mut self.slots);
        let mut last = cx.clone();
        let start = Affine::constant((full * PIECE) as i64);
        let Some(rest_value) = self.fold_terms(fold, rest, &start, &mut last, term)? else { return Ok(None) };
        let rest_slots = std::mem::replace(&mut self.slots, full_slots);

        let pieces = full + usize::from(rest > 0);
        let origin = Origin { path: self.path(cx.scope.inst), span };
        let number = self.next_fold();
        let sizes: Vec<usize> = around.iter().copied().filter(|&count| count > 1).chain([pieces]).collect();
        let parts = self.auxiliary(fold, format!("${}{number}.part", fold.name()), &sizes, origin.clone());
        let strides = strides(&around);
        let scaled = crate::state::flattener::scale(&strides, pieces);
        let target = scaled.add_scaled(&piece, 1).ok_or(Fail::NeedsExpansion)?;
        self.emit_piece(parts, target, full_value, &inner.loop_counts(), &origin);
        if rest > 0 {
            self.slots = rest_slots;
            let target = scaled.add_scaled(&Affine::constant(full as i64), 1).ok_or(Fail::NeedsExpansion)?;
            self.emit_piece(parts, target, rest_value, &around, &origin);
        }
        let name = format!("${}{number}", fold.name());
        let result = self.fold_levels(fold, (parts, rows, pieces), (&name, &sizes[..sizes.len() - 1]), &origin);
        Ok(Some((result, strides)))
    }

    /// The fold of `count` neighbouring elements; none if they are not Real.
    fn fold_terms(
        &mut self,
        fold: Fold,
        count: usize,
        start: &Affine,
        cx: &mut Context,
        term: Term<'t, 's, '_>,
    ) -> Result<Option<NodeId>, Fail> {
        let mut nodes = Vec::with_capacity(count);
        for k in 0..count as i64 {
            let at = start.add_scaled(&Affine::constant(k), 1).ok_or(Fail::NeedsExpansion)?;
            let value = term(self, cx, &at)?;
            if value.scalar != ScalarType::Real {
                return Ok(None);
            }
            nodes.push(value.node);
        }
        Ok(Some(fold.combine(&mut self.model.templates.arena, nodes)))
    }

    fn emit_piece(&mut self, parts: VarId, target: Affine, value: NodeId, counts: &[usize], origin: &Origin) {
        let slot = self.slots.slot(SlotKey::Variable(Kind::Var, parts, target));
        let left = self.model.templates.arena.slot(slot);
        self.define(left, value, counts, origin);
    }

    /// Folds rows of `count` neighbouring variables until one is left in each row.
    fn fold_levels(
        &mut self,
        fold: Fold,
        (mut first, rows, mut count): (VarId, usize, usize),
        (name, sizes): (&str, &[usize]),
        origin: &Origin,
    ) -> VarId {
        let mut level = 2;
        while count > 1 {
            let next = count.div_ceil(PIECE);
            let (sizes, name) = match next {
                1 => (sizes.to_vec(), name.to_string()),
                _ => (sizes.iter().copied().chain([next]).collect(), format!("{name}.part{level}")),
            };
            let target = self.auxiliary(fold, name, &sizes, origin.clone());
            let neutral = Operand::new(Target::Const(self.number(fold.neutral())));
            let mut operands = Vec::with_capacity(rows * next * (PIECE + 1));
            for row in 0..rows {
                for piece in 0..next {
                    operands.push(Operand::new(Target::Var(VarId(target.0 + (row * next + piece) as u32))));
                    let at = |k: usize| Operand::new(Target::Var(VarId(first.0 + (row * count + k) as u32)));
                    let members = piece * PIECE..(piece + 1) * PIECE;
                    operands.extend(members.map(|k| if k < count { at(k) } else { neutral }));
                }
            }
            self.add_fold(fold, operands, origin);
            (first, count, level) = (target, next, level + 1);
        }
        first
    }

    /// Sets of variables (with signs) whose sum is zero, each a few terms only: long sums get auxiliary variables.
    pub(crate) fn bounded_sum(&mut self, terms: Vec<Operand>, origin: &Origin) -> Vec<Operand> {
        let mut terms = terms;
        if terms.len() <= LONGEST {
            return terms;
        }
        let name = format!("$sum{}", self.next_fold());
        let zero = Operand::new(Target::Const(self.number(0.0)));
        let mut level = 1;
        while terms.len() > PIECE {
            let next = terms.len().div_ceil(PIECE);
            let target = self.auxiliary(Fold::Sum, format!("{name}.part{level}"), &[next], origin.clone());
            let mut operands = Vec::with_capacity(next * (PIECE + 1));
            for (k, piece) in terms.chunks(PIECE).enumerate() {
                operands.push(Operand::new(Target::Var(VarId(target.0 + k as u32))));
                operands.extend_from_slice(piece);
                operands.extend(std::iter::repeat_n(zero, PIECE - piece.len()));
            }
            self.add_fold(Fold::Sum, operands, origin);
            terms = (0..next as u32).map(|k| Operand::new(Target::Var(VarId(target.0 + k)))).collect();
            level += 1;
        }
        terms.resize(PIECE, zero);
        terms
    }

    /// Equations `x_0 = x_1 op ... op x_8`.
    fn add_fold(&mut self, fold: Fold, operands: Vec<Operand>, origin: &Origin) {
        let arena = &mut self.model.templates.arena;
        let left = arena.slot(SlotId(0));
        let members = (1..=PIECE as u32).map(|k| arena.slot(SlotId(k))).collect();
        let right = fold.combine(arena, members);
        let (id, order) = self.template(left, right);
        let width = PIECE + 1;
        let ordered = operands.chunks(width).flat_map(|own| order.iter().map(|slot| own[slot.0 as usize])).collect();
        let count = (operands.len() / width) as u32;
        self.tables().equations.push(EquationBlock {
            section: Section::Continuous,
            made: true,
            template: id,
            count,
            operands: ordered,
            origin: origin.clone(),
        });
    }

    /// Variables for a fold or its parts.
    fn auxiliary(&mut self, fold: Fold, name: String, sizes: &[usize], origin: Origin) -> VarId {
        self.make(Made::Fold(fold.name()), name, sizes, (ValueKind::Real, Variability::Continuous), origin)
    }
}

/// The counters around as one number, the last fastest.
fn strides(counts: &[usize]) -> Affine {
    let mut result = Affine::constant(0);
    let mut stride = 1;
    for (k, &count) in counts.iter().enumerate().rev() {
        if count > 1 {
            result.terms.insert(0, (CounterId(k as u32), stride));
        }
        stride *= count as i64;
    }
    result
}
