//! Records inside expressions and functions: fields, and what makes a record.

use hyd_instance::{Builtin, InstId};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{ComponentRef, Ident, RefPart};
use hyd_typed::{Base, Expr, Iterator, Kind, Local as Path, Type, Variable};

use crate::expressions::lower::MAX_TERMS;
use crate::expressions::record_made::none_of;
use crate::expressions::value::Fields;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    /// A record expression as its fields; `None` if the expression is not a record.
    pub(crate) fn as_record(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Local>, Fail> {
        match &expr.kind {
            Kind::Local(name) if cx.local(name.name()).is_some() => {
                let (local, subscripts) = self.leaf_of_path(name, cx)?;
                match local {
                    Local::Record(_) => Ok(Some(local)),
                    Local::Records(fields, shape) => {
                        self.select_records(expr.span, (fields, shape), &subscripts, cx).map(Some)
                    }
                    _ => Ok(None),
                }
            }
            Kind::Variable(variable) if self.scopes.instances[variable.last()].primitive.is_none() => {
                self.record_of_components(expr, variable, cx).map(Some)
            }
            Kind::Array(_) | Kind::ArrayFor(..) => self.array_of_records(expr, cx),
            Kind::If(branches, otherwise) => self.record_by_condition(branches, otherwise, cx),
            Kind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.as_record(only, cx),
                _ => Ok(None),
            },
            Kind::Builtin(Builtin::Fill, list) => self.filled_records(expr.span, list, cx),
            Kind::Call(_) | Kind::Record(_) if expr.ty.is_record() => self.call(expr, cx).map(Some),
            Kind::Field(record, name) => {
                let field = self.field_value(record, name, cx)?;
                Ok(matches!(field, Local::Record(_) | Local::Records(..)).then_some(field))
            }
            Kind::Failed(said, _) => Err(self.say(said)),
            _ => Ok(None),
        }
    }

    /// The fields of a component that is a record.
    fn record_of_components(&mut self, expr: &Expr, variable: &Variable, cx: &mut Context) -> Result<Local, Fail> {
        let children = self.scopes.instances[variable.last()].children.clone();
        let mut fields = Vec::with_capacity(children.len());
        for child in children {
            let name = self.scopes.instances[child].name.clone();
            let value = self.component_of(expr, variable, child);
            fields.push((name, self.local_value(&value, cx)?));
        }
        let shape = self.steps_shape(&variable.steps, cx)?;
        Ok(if shape.is_empty() { Local::Record(fields) } else { Local::Records(fields, shape) })
    }

    /// A component of the component that an expression names.
    pub(crate) fn component_of(&self, expr: &Expr, variable: &Variable, child: InstId) -> Expr {
        let instance = &self.scopes.instances[child];
        let mut steps = variable.steps.clone();
        steps.push((child, Vec::new()));
        let mut reference = ComponentRef::clone(&variable.reference);
        let name = Ident { name: instance.name.clone(), span: reference.span };
        reference.parts.push(RefPart { name, subscripts: Vec::new() });
        let base = match (&instance.primitive, &expr.ty.base) {
            (Some(primitive), _) => Base::Scalar(primitive.scalar.clone()),
            (None, Base::Record(_)) => expr.ty.field(&instance.name).map_or(Base::None, |ty| ty.base),
            _ => Base::None,
        };
        let rank = expr.ty.rank + instance.dims.len();
        let kind = Kind::Variable(Variable { steps, reference: reference.into() });
        Expr { kind, ty: Type { base, rank }, span: expr.span }
    }

    /// `if c then r else s` of records.
    fn record_by_condition(
        &mut self,
        branches: &[(Expr, Expr)],
        otherwise: &Expr,
        cx: &mut Context,
    ) -> Result<Option<Local>, Fail> {
        let Some(mut result) = self.as_record(otherwise, cx)? else { return Ok(None) };
        for (condition, value) in branches.iter().rev() {
            let Some(value) = self.as_record(value, cx)? else {
                return Err(self.error(Code::TypeMismatch, value.span, "a record is needed here"));
            };
            let test = self.lower(condition, cx, &[])?;
            self.want_boolean(condition.span, "a condition", &test)?;
            result = match self.model.templates.arena.as_constant(test.node) {
                Some(0.0) => result,
                Some(_) => value,
                None => self.join(condition.span, test.node, &value, &result)?,
            };
        }
        Ok(Some(result))
    }

    /// `call.field`
    pub(crate) fn lower_field(
        &mut self,
        record: &Expr,
        name: &Ident,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let local = self.field_value(record, name, cx)?;
        self.element_of_local(record.span, &local, index)
    }

    pub(crate) fn field_value(&mut self, record: &Expr, name: &Ident, cx: &mut Context) -> Result<Local, Fail> {
        if let Some(field) = self.field_of_constructor(record, name, cx)? {
            return Ok(field);
        }
        let value = self.local_value(record, cx)?;
        let fields = self.fields_of(record.span, value)?;
        match fields.into_iter().find(|(n, _)| *n == name.name) {
            Some((_, local)) => Ok(local),
            None => {
                let message = format!("the record has no field `{}`", name.name);
                Err(self.error(Code::TypeMismatch, record.span, message))
            }
        }
    }

    /// The local value that a reference ends in, and the subscripts of the whole path for it.
    pub(crate) fn leaf_of_path(&mut self, path: &Path, cx: &Context) -> Result<(Local, Vec<Expr>), Fail> {
        let Some(mut local) = cx.local(path.name()).cloned() else { return Err(self.not_set(path)) };
        let mut subscripts = Vec::new();
        for (k, (part, _)) in path.parts.iter().enumerate() {
            if k > 0 {
                let next = match local {
                    Local::Record(fields) | Local::Records(fields, _) => {
                        fields.into_iter().find(|(n, _)| *n == part.name).map(|(_, l)| l)
                    }
                    _ => None,
                };
                let Some(found) = next else { return Err(self.no_field(part.span, &part.name)) };
                local = found;
            }
            join_subscripts(&mut subscripts, rank(&local), path, k);
        }
        Ok((local, subscripts))
    }

    /// A name that has no value yet.
    fn not_set(&mut self, path: &Path) -> Fail {
        let (name, _) = &path.parts[0];
        self.error(Code::UnknownName, name.span, format!("`{}` has no value here: nothing has set it", name.name))
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
            Kind::Array(items) => {
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
            Kind::ArrayFor(body, iterators) => {
                return match expr.ty.is_record() {
                    true => self.records_for(body, iterators, cx).map(Some),
                    false => Ok(None),
                };
            }
            _ => return Ok(None),
        };
        if all.is_empty() { Ok(None) } else { self.stacked(expr.span, all).map(Some) }
    }

    /// `fill(r, n, m)` of a record; `None` of something else.
    pub(crate) fn filled_records(
        &mut self,
        span: Span,
        list: &[Expr],
        cx: &mut Context,
    ) -> Result<Option<Local>, Fail> {
        let [record, sizes @ ..] = list else { return Ok(None) };
        if !record.ty.is_record() {
            return Ok(None);
        }
        let Some(mut value) = self.as_record(record, cx)? else { return Ok(None) };
        for size in sizes.iter().rev() {
            let count = self.affine(size, cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
            let Some(count) = usize::try_from(count).ok().filter(|&count| count <= MAX_TERMS) else {
                let message = format!("the size {count} is negative or above {MAX_TERMS}");
                return Err(self.error(Code::ArrayShape, size.span, message));
            };
            value = match count {
                0 => none_of(value, &[0]),
                _ => self.stacked(span, vec![value; count])?,
            };
        }
        Ok(Some(value))
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
}

/// Number of dimensions of a local value.
pub(crate) fn rank(local: &Local) -> usize {
    match local {
        Local::Array(_, shape) | Local::Records(_, shape) => shape.len(),
        _ => 0,
    }
}

/// Adds the subscripts of part `k`; those left out before another part stand for all.
pub(crate) fn join_subscripts(subscripts: &mut Vec<Expr>, rank: usize, path: &Path, k: usize) {
    let (name, written) = &path.parts[k];
    let own = rank.saturating_sub(subscripts.len());
    subscripts.extend(written.iter().cloned());
    if k + 1 < path.parts.len() {
        let all = Expr { kind: Kind::Colon, ty: Type::NONE.with_rank(1), span: name.span };
        subscripts.extend(std::iter::repeat_n(all, own.saturating_sub(written.len())));
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
