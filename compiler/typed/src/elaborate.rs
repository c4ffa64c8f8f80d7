//! Syntax to typed expressions, in the scope of an instance or of a function.
//!
//! Names are looked up once, here, and every expression gets its type (Modelica 3.6, sections 5.3, 6.7 and chapter 10).  A branch of
//! an `if` may hold anything as long as it is not taken, so what has no meaning in one becomes [`Kind::Failed`] with its messages,
//! which are said by whoever needs its value.

use std::rc::Rc;

use hyd_instance::operators::{operate_on_one, operate_on_two};
use hyd_instance::{InstId, ScalarType, Scope, Scopes};
use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{self as text, BinaryOp, ExprKind, Name, UnaryOp};
use rustc_hash::FxHashMap;

use crate::expression::{Expr, Iterator, Kind};
use crate::function::{Function, Signature};
use crate::types::{Base, RecordType, Type, scalar_of};

/// The sizes that the fields of a record are declared with, in their order, each with the frame its text belongs to.
pub type FieldDims = Rc<[(u32, Vec<Expr>)]>;

/// What has been typed so far and is asked for again.
#[derive(Default)]
pub struct Typing {
    pub(crate) signatures: FxHashMap<InstId, Rc<Signature>>,
    /// Functions whose signatures are being put together.
    pub(crate) open: Vec<InstId>,
    pub(crate) functions: FxHashMap<InstId, Rc<Function>>,
    pub(crate) records: FxHashMap<InstId, Rc<RecordType>>,
    pub(crate) dims: FxHashMap<InstId, FieldDims>,
}

impl Typing {
    /// The sizes of the fields of a record.
    pub fn dims_of_fields(&self, record: &RecordType) -> FieldDims {
        record.inst.and_then(|inst| self.dims.get(&inst).cloned()).unwrap_or_default()
    }
}

/// Types the text of one scope.
pub struct Elaborator<'t, 's> {
    /// What names mean.
    pub scopes: &'t mut Scopes<'s>,
    /// What is known of functions.
    pub typing: &'t mut Typing,
    /// Where names are looked up.
    pub scope: Scope,
    /// Local names, innermost last.
    pub locals: Vec<(Name, Type)>,
    /// The text is that of a function.
    pub(crate) in_function: bool,
    /// The text stands inside `when`.
    pub(crate) in_when: bool,
}

const REAL: Type = Type::scalar(ScalarType::Real);
const INTEGER: Type = Type::scalar(ScalarType::Integer);
const BOOLEAN: Type = Type::scalar(ScalarType::Boolean);

impl<'t, 's> Elaborator<'t, 's> {
    /// For the text of a scope with these local names around it.
    pub fn new(scopes: &'t mut Scopes<'s>, typing: &'t mut Typing, scope: Scope, locals: Vec<(Name, Type)>) -> Self {
        Self { scopes, typing, scope, locals, in_function: false, in_when: false }
    }
}

impl Elaborator<'_, '_> {
    pub(crate) fn error(&mut self, code: Code, span: Span, message: impl Into<String>) -> Reported {
        self.scopes.error(code, span, message)
    }

    /// What `make` makes, or what it says in failing.
    pub(crate) fn tried<T>(
        &mut self,
        make: impl FnOnce(&mut Self) -> Result<T, Reported>,
    ) -> Result<T, Rc<[Diagnostic]>> {
        self.scopes.table.messages.begin();
        let made = make(self);
        let said = self.scopes.table.messages.end();
        match made {
            Ok(made) => {
                self.scopes.table.messages.report_all(said);
                Ok(made)
            }
            Err(Reported) => Err(said.into()),
        }
    }

    /// An expression whose value may never be needed.
    pub(crate) fn deferred(&mut self, expr: &text::Expr) -> Expr {
        self.tried(|own| own.expr(expr)).unwrap_or_else(|said| Expr {
            kind: Kind::Failed(said, Rc::new(expr.clone())),
            ty: Type::NONE,
            span: expr.span,
        })
    }

    /// An expression with its names resolved and its type.
    ///
    /// # Errors
    /// When a name means nothing, or a call is not one; reported.
    pub fn expr(&mut self, expr: &text::Expr) -> Result<Expr, Reported> {
        let span = expr.span;
        let (kind, ty) = match &expr.kind {
            ExprKind::Integer(k) if k.unsigned_abs() > hyd_instance::value::LARGEST_INTEGER as u64 => {
                (Kind::Integer(*k), REAL)
            }
            ExprKind::Integer(k) => (Kind::Integer(*k), INTEGER),
            ExprKind::Real(x) => (Kind::Real(*x), REAL),
            ExprKind::Text(text) => (Kind::Text(text.clone()), Type::scalar(ScalarType::Text)),
            ExprKind::Boolean(b) => (Kind::Boolean(*b), BOOLEAN),
            ExprKind::Ref(reference) => return self.reference(reference),
            ExprKind::Call(function, arguments) => return self.call(span, function, arguments),
            ExprKind::Partial(function, given) => return self.partial(span, function, given),
            ExprKind::Unary(op, a) => {
                let a = self.expr(a)?;
                if a.ty.is_record()
                    && let Some(call) = operate_on_one(self, span, *op, &a)?
                {
                    return Ok(call);
                }
                let ty = if *op == UnaryOp::Not { BOOLEAN.with_rank(a.ty.rank) } else { a.ty.clone() };
                (Kind::Unary(*op, Box::new(a)), ty)
            }
            ExprKind::Binary(op, a, b) => {
                let (a, b) = (self.expr(a)?, self.expr(b)?);
                if (a.ty.is_record() || b.ty.is_record())
                    && let Some(call) = operate_on_two(self, span, *op, (&a, &b))?
                {
                    return Ok(call);
                }
                let ty = type_of_binary(*op, &a.ty, &b.ty);
                (Kind::Binary(*op, Box::new(a), Box::new(b)), ty)
            }
            ExprKind::If(branches, otherwise) => {
                let mut typed = Vec::with_capacity(branches.len());
                let mut ty = Type::NONE;
                for (condition, value) in branches {
                    let condition = self.deferred(condition);
                    let value = self.deferred(value);
                    ty = ty.join(&value.ty);
                    typed.push((condition, value));
                }
                let otherwise = self.deferred(otherwise);
                ty = ty.join(&otherwise.ty);
                (Kind::If(typed, Box::new(otherwise)), ty)
            }
            ExprKind::Range(start, step, stop) => {
                let start = self.expr(start)?;
                let step = step.as_ref().map(|step| self.expr(step)).transpose()?;
                let stop = self.expr(stop)?;
                let ends = start.ty.join(&stop.ty);
                let ty = step.as_ref().map_or(ends.clone(), |step| ends.join(&step.ty)).with_rank(1);
                (Kind::Range(Box::new(start), step.map(Box::new), Box::new(stop)), ty)
            }
            ExprKind::Array(items) => {
                let items = self.all(items)?;
                let ty = joined(&items);
                let rank = ty.rank + 1;
                (Kind::Array(items), ty.with_rank(rank))
            }
            ExprKind::ArrayFor(body, iterators) => {
                // The last iterator is the outermost (10.4.1).
                let (iterators, body) = self.with_iterators(iterators, true, |own| own.expr(body))?;
                let ty = body.ty.with_rank(body.ty.rank + iterators.len());
                (Kind::ArrayFor(Box::new(body), iterators), ty)
            }
            ExprKind::Matrix(rows) => {
                let mut rows: Vec<Vec<Expr>> = rows.iter().map(|row| self.all(row)).collect::<Result<_, _>>()?;
                // `[A]` of a matrix, or of an array with more dimensions, is `A` (10.4.2).
                if let [row] = rows.as_mut_slice()
                    && row.len() == 1
                    && row[0].ty.rank >= 2
                {
                    let only = row.swap_remove(0);
                    let ty = only.ty.clone();
                    return Ok(Expr { kind: Kind::Tuple(vec![Some(only)]), ty, span });
                }
                let ty = rows.iter().flatten().fold(Type::NONE, |ty, part| ty.join(&part.ty));
                (Kind::Matrix(rows), ty.with_rank(2))
            }
            ExprKind::Tuple(items) => {
                let items: Vec<Option<Expr>> =
                    items.iter().map(|e| e.as_ref().map(|e| self.expr(e)).transpose()).collect::<Result<_, _>>()?;
                let ty = match items.as_slice() {
                    [Some(only)] => only.ty.clone(),
                    _ => Type::NONE,
                };
                (Kind::Tuple(items), ty)
            }
            ExprKind::Field(record, name) => {
                let record = self.expr(record)?;
                let ty = record.ty.field(&name.name).unwrap_or(Type::NONE);
                (Kind::Field(Box::new(record), name.clone()), ty)
            }
            ExprKind::Colon => (Kind::Colon, INTEGER.with_rank(1)),
            ExprKind::End => (Kind::End, INTEGER),
        };
        Ok(Expr { kind, ty, span })
    }

    pub(crate) fn all(&mut self, list: &[text::Expr]) -> Result<Vec<Expr>, Reported> {
        list.iter().map(|expr| self.expr(expr)).collect()
    }

    /// Loop variables with their ranges, and what is inside; `last_first`: ranges may name the variables behind them.
    pub(crate) fn with_iterators<T>(
        &mut self,
        iterators: &[text::Iterator],
        last_first: bool,
        body: impl FnOnce(&mut Self) -> Result<T, Reported>,
    ) -> Result<(Vec<Iterator>, T), Reported> {
        let mark = self.locals.len();
        let made = self.iterators(iterators, last_first).and_then(|typed| Ok((typed, body(self)?)));
        self.locals.truncate(mark);
        made
    }

    fn iterators(&mut self, iterators: &[text::Iterator], last_first: bool) -> Result<Vec<Iterator>, Reported> {
        let mut typed = Vec::with_capacity(iterators.len());
        let mut one = |own: &mut Self, iterator: &text::Iterator| -> Result<(), Reported> {
            let Some(range) = &iterator.range else { return Err(own.scopes.no_range(iterator)) };
            let range = own.expr(range)?;
            own.locals.push((iterator.name.name.clone(), range.ty.with_rank(0)));
            typed.push(Iterator { name: iterator.name.clone(), range });
            Ok(())
        };
        match last_first {
            true => iterators.iter().rev().try_for_each(|iterator| one(self, iterator))?,
            false => iterators.iter().try_for_each(|iterator| one(self, iterator))?,
        }
        if last_first {
            typed.reverse();
        }
        Ok(typed)
    }
}

/// What the elements of a list are together.
pub(crate) fn joined(items: &[Expr]) -> Type {
    items.iter().fold(Type::NONE, |ty, item| ty.join(&item.ty))
}

/// Modelica 3.6, sections 10.6 and 3.3 to 3.5.
fn type_of_binary(op: BinaryOp, a: &Type, b: &Type) -> Type {
    use BinaryOp as Op;
    let rank = match (op, a.rank, b.rank) {
        (Op::Equal | Op::NotEqual | Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual, ..) => 0,
        (Op::Mul, 1, 1) => 0,
        (Op::Mul, 2, 1) | (Op::Mul, 1, 2) => 1,
        (_, left, right) => left.max(right),
    };
    let base = match op {
        Op::Equal | Op::NotEqual | Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual | Op::And | Op::Or => {
            Base::Scalar(ScalarType::Boolean)
        }
        _ if a.is_text() || b.is_text() => Base::Scalar(ScalarType::Text),
        Op::Div | Op::ElementDiv | Op::ElementPow => Base::Scalar(ScalarType::Real),
        Op::Pow if a.rank == 0 => Base::Scalar(ScalarType::Real),
        Op::Pow => a.base.clone(),
        _ => {
            let whole = scalar_of(&a.base) == ScalarType::Integer && scalar_of(&b.base) == ScalarType::Integer;
            Base::Scalar(if whole { ScalarType::Integer } else { ScalarType::Real })
        }
    };
    Type { base, rank }
}
