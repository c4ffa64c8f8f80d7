//! Arrays of records inside expressions and functions.
//!
//! Such an array is held as a record of arrays: `p[i].x` is element `i` of the field `x`, whose sizes are those of `p` and then its
//! own.  So subscripts of a path are joined into one list for the field it ends in, and elements, slices, assignments and
//! subscripts computed in the run are those of plain arrays.

use hyd_instance::{Builtin, Resolved};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{Arguments, ClassKind, ComponentRef, Expr, ExprKind, Iterator, Name};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::MAX_TERMS;

type Fields = Vec<(Name, Local)>;

impl Flattener<'_, '_> {
    /// The local value that a reference ends in, and the subscripts of the whole path for it.
    pub(crate) fn leaf_of_path(&mut self, reference: &ComponentRef, cx: &Context) -> Result<(Local, Vec<Expr>), Fail> {
        let mut local = cx.local(&reference.parts[0].name.name).cloned().ok_or(Fail::Reported)?;
        let mut subscripts = Vec::new();
        for (k, part) in reference.parts.iter().enumerate() {
            if k > 0 {
                let next = match local {
                    Local::Record(fields) | Local::Records(fields, _) => {
                        fields.into_iter().find(|(n, _)| *n == part.name.name).map(|(_, l)| l)
                    }
                    _ => None,
                };
                let Some(found) = next else { return Err(self.no_field(part.name.span, &part.name.name)) };
                local = found;
            }
            join_subscripts(&mut subscripts, rank(&local), reference, k);
        }
        Ok((local, subscripts))
    }

    pub(crate) fn no_field(&mut self, span: Span, name: &Name) -> Fail {
        self.error(Code::UnknownName, span, format!("there is no field `{name}`"))
    }

    /// The fields of a record or an array of them.
    pub(crate) fn fields_of(&mut self, span: Span, value: Local) -> Result<Fields, Fail> {
        match value {
            Local::Record(fields) | Local::Records(fields, _) => Ok(fields),
            _ => Err(self.error(Code::TypeMismatch, span, "a record is needed here")),
        }
    }

    /// The elements of an array of records that subscripts name: a record, or an array of them.
    pub(crate) fn select_records(
        &mut self,
        span: Span,
        (fields, shape): (Fields, Vec<usize>),
        subscripts: &[Expr],
        cx: &mut Context,
    ) -> Result<Local, Fail> {
        if subscripts.is_empty() {
            return Ok(Local::Records(fields, shape));
        }
        let kept = self.kept_sizes(&shape, subscripts, cx)?;
        let mut selected = Vec::with_capacity(fields.len());
        for (name, field) in fields {
            let part = match field {
                Local::Records(inner, sizes) => self.select_records(span, (inner, sizes), subscripts, cx)?,
                Local::Array(items, sizes) => {
                    let own = self.kept_sizes(&sizes, subscripts, cx)?;
                    let mut values = Vec::with_capacity(own.iter().product());
                    for k in 0..own.iter().product() {
                        let at: Vec<Affine> =
                            positions(k, &own).into_iter().map(|k| Affine::constant(k as i64)).collect();
                        values.push(self.array_element(span, &items, &sizes, subscripts, cx, &at)?);
                    }
                    match (own.is_empty(), values.pop()) {
                        (true, Some(value)) => Local::Node(value),
                        (_, last) => {
                            values.extend(last);
                            Local::array(values, own)
                        }
                    }
                }
                other => other,
            };
            selected.push((name, part));
        }
        Ok(if kept.is_empty() { Local::Record(selected) } else { Local::Records(selected, kept) })
    }

    /// `{r, s}` and `{f(i) for i in range}` of records; `None` if they are of something else.
    pub(crate) fn array_of_records(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Local>, Fail> {
        let all = match &expr.kind {
            ExprKind::Array(items) => {
                let mut all = Vec::with_capacity(items.len());
                for item in items {
                    match self.as_record(item, cx)? {
                        Some(record) => all.push(record),
                        None if all.is_empty() => return Ok(None),
                        None => return Err(self.error(Code::TypeMismatch, item.span, "a record is needed here")),
                    }
                }
                all
            }
            ExprKind::ArrayFor(body, iterators) => {
                let mark = cx.names.len();
                let hidden = |i: &Iterator| (i.name.name.clone(), Local::Index(Affine::constant(1)));
                cx.names.extend(iterators.iter().map(hidden));
                let record = self.is_record(body, cx);
                cx.names.truncate(mark);
                if !record? {
                    return Ok(None);
                }
                return self.records_for(body, iterators, cx).map(Some);
            }
            _ => return Ok(None),
        };
        if all.is_empty() { Ok(None) } else { self.stacked(expr.span, all).map(Some) }
    }

    /// True if the value of an expression is a record or an array of records, as far as the text says.
    fn is_record(&mut self, expr: &Expr, cx: &mut Context) -> Result<bool, Fail> {
        Ok(match &expr.kind {
            ExprKind::Ref(reference) => {
                if !reference.global
                    && let Some(mut local) = cx.local(&reference.parts[0].name.name)
                {
                    for part in &reference.parts[1..] {
                        let (Local::Record(fields) | Local::Records(fields, _)) = local else { return Ok(false) };
                        let Some((_, field)) = fields.iter().find(|(n, _)| *n == part.name.name) else {
                            return Ok(false);
                        };
                        local = field;
                    }
                    return Ok(matches!(local, Local::Record(_) | Local::Records(..)));
                }
                match self.tree.resolve(cx.scope, reference)? {
                    Resolved::Variable(steps) => {
                        self.tree.instances[steps[steps.len() - 1].0].kind == ClassKind::Record
                    }
                    _ => false,
                }
            }
            ExprKind::Call(function, Arguments::List { positional, .. }) => match self.predefined(function, cx) {
                Some(Builtin::Fill) => positional.first().map_or(Ok(false), |first| self.is_record(first, cx))?,
                Some(_) => false,
                None => self.makes_record(function, cx)?,
            },
            ExprKind::Array(items) => items.first().map_or(Ok(false), |first| self.is_record(first, cx))?,
            ExprKind::If(_, otherwise) => self.is_record(otherwise, cx)?,
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.is_record(only, cx)?,
                _ => false,
            },
            ExprKind::ArrayFor(body, iterators) => {
                let mark = cx.names.len();
                let hidden = |i: &Iterator| (i.name.name.clone(), Local::Index(Affine::constant(1)));
                cx.names.extend(iterators.iter().map(hidden));
                let record = self.is_record(body, cx);
                cx.names.truncate(mark);
                record?
            }
            ExprKind::Field(record, name) => {
                matches!(self.field_value(record, name, cx)?, Local::Record(_) | Local::Records(..))
            }
            _ => false,
        })
    }

    /// `fill(r, n, m)` of a record; `None` of something else.
    pub(crate) fn filled_records(
        &mut self,
        span: Span,
        list: &[Expr],
        cx: &mut Context,
    ) -> Result<Option<Local>, Fail> {
        let [record, sizes @ ..] = list else { return Ok(None) };
        if !self.is_record(record, cx)? {
            return Ok(None);
        }
        let Some(mut value) = self.as_record(record, cx)? else { return Ok(None) };
        for size in sizes.iter().rev() {
            let count = self.affine(size, cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
            let Some(count) = usize::try_from(count).ok().filter(|&count| count <= MAX_TERMS) else {
                let message = format!("the size {count} is negative or above {MAX_TERMS}");
                return Err(self.error(Code::ArrayShape, size.span, message));
            };
            value = self.stacked(span, vec![value; count])?;
        }
        Ok(Some(value))
    }

    /// The part of a value at subscripts from 1 of its first dimensions.
    pub(crate) fn part_of(&mut self, span: Span, value: Local, at: &[usize]) -> Result<Local, Fail> {
        if at.is_empty() {
            return Ok(value);
        }
        let offset = |shape: &[usize]| {
            let inside = at.len() <= shape.len() && at.iter().zip(shape).all(|(&k, &size)| k >= 1 && k <= size);
            inside.then(|| at.iter().zip(shape).fold(0, |all, (&k, &size)| all * size + k - 1))
        };
        match value {
            Local::Array(items, shape) if offset(&shape).is_some() => {
                let inner = shape[at.len()..].to_vec();
                let (count, first) = (inner.iter().product::<usize>(), offset(&shape).unwrap_or(0));
                let part = items[first * count..(first + 1) * count].to_vec();
                match (inner.is_empty(), part.first()) {
                    (true, Some(only)) => Ok(Local::Node(only.clone())),
                    _ => Ok(Local::array(part, inner)),
                }
            }
            Local::Records(fields, shape) if offset(&shape).is_some() => {
                let mut parts = Vec::with_capacity(fields.len());
                for (name, field) in fields {
                    parts.push((name, self.part_of(span, field, at)?));
                }
                let inner = shape[at.len()..].to_vec();
                Ok(if inner.is_empty() { Local::Record(parts) } else { Local::Records(parts, inner) })
            }
            _ => Err(self.error(Code::ArrayShape, span, "this gives too few elements to an array of records")),
        }
    }

    /// The last iterator is the outermost (10.4.1).
    fn records_for(&mut self, body: &Expr, iterators: &[Iterator], cx: &mut Context) -> Result<Local, Fail> {
        let Some((outer, inner)) = iterators.split_last() else {
            let record = self.as_record(body, cx)?;
            return record.ok_or_else(|| self.error(Code::TypeMismatch, body.span, "a record is needed here"));
        };
        let range = self.range(outer, cx)?;
        let mut all = Vec::with_capacity(range.count());
        for k in 0..range.count() {
            let local = range.local(k)?;
            let mark = cx.names.len();
            cx.names.push((outer.name.name.clone(), local));
            let value = self.records_for(body, inner, cx);
            cx.names.truncate(mark);
            all.push(value?);
        }
        self.stacked(body.span, all)
    }

    /// Values of one kind as an array with one dimension more.
    pub(crate) fn stacked(&mut self, span: Span, all: Vec<Local>) -> Result<Local, Fail> {
        let count = all.len();
        let longer = |shape: &[usize]| std::iter::once(count).chain(shape.iter().copied()).collect::<Vec<_>>();
        let Some(first) = all.first().cloned() else {
            return Err(self.error(Code::ArrayShape, span, "an array of records needs elements"));
        };
        match first {
            Local::Record(fields) => Ok(Local::Records(self.stacked_fields(span, &fields, &all)?, vec![count])),
            Local::Records(fields, shape) => {
                Ok(Local::Records(self.stacked_fields(span, &fields, &all)?, longer(&shape)))
            }
            Local::Array(_, shape) => {
                let mut items = Vec::new();
                for value in all {
                    match value {
                        Local::Array(own, other) if other == shape => items.extend(own.iter().cloned()),
                        _ => {
                            let message = "the elements of this array have different sizes";
                            return Err(self.error(Code::ArrayShape, span, message));
                        }
                    }
                }
                Ok(Local::array(items, longer(&shape)))
            }
            _ => {
                let mut items = Vec::with_capacity(count);
                for value in &all {
                    items.push(self.as_node(span, value)?);
                }
                Ok(Local::array(items, vec![count]))
            }
        }
    }

    fn stacked_fields(&mut self, span: Span, fields: &Fields, all: &[Local]) -> Result<Fields, Fail> {
        let mut result = Vec::with_capacity(fields.len());
        for (name, _) in fields {
            let mut column = Vec::with_capacity(all.len());
            for value in all {
                let own = self.fields_of(span, value.clone())?;
                let Some((_, field)) = own.into_iter().find(|(n, _)| n == name) else {
                    return Err(self.no_field(span, name));
                };
                column.push(field);
            }
            result.push((name.clone(), self.stacked(span, column)?));
        }
        Ok(result)
    }
}

/// Number of dimensions of a local value.
pub(crate) fn rank(local: &Local) -> usize {
    match local {
        Local::Array(_, shape) | Local::Records(_, shape) => shape.len(),
        _ => 0,
    }
}

/// Adds the subscripts of part `k`; those left out before another part stand for all.
pub(crate) fn join_subscripts(subscripts: &mut Vec<Expr>, rank: usize, reference: &ComponentRef, k: usize) {
    let part = &reference.parts[k];
    let own = rank.saturating_sub(subscripts.len());
    subscripts.extend(part.subscripts.iter().cloned());
    if k + 1 < reference.parts.len() {
        let all = Expr { kind: ExprKind::Colon, span: part.name.span };
        subscripts.extend(std::iter::repeat_n(all, own.saturating_sub(part.subscripts.len())));
    }
}

/// Subscripts from 0 of element `k`, the last fastest.
fn positions(k: usize, shape: &[usize]) -> Vec<usize> {
    let mut rest = k;
    let mut at = vec![0; shape.len()];
    for (position, &size) in shape.iter().enumerate().rev() {
        at[position] = rest % size;
        rest /= size;
    }
    at
}
