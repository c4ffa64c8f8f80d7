//! Records inside expressions and functions: fields, and what makes a record.

use hyd_instance::class::elements;
use hyd_instance::{Builtin, Resolved, Scope};
use hyd_source::Code;
use hyd_syntax::tree::{
    Arguments, ClassKind, ComponentRef, Direction, Element, Expr, ExprKind, Ident, Name, Variability,
};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::function::simple_type;
use crate::index::Affine;
use crate::lower::Typed;

impl Flattener<'_, '_> {
    /// A record expression as its fields; `None` if the expression is not a record.
    pub(crate) fn as_record(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Local>, Fail> {
        match &expr.kind {
            ExprKind::Ref(reference) => {
                if !reference.global && cx.local(&reference.parts[0].name.name).is_some() {
                    let (local, subscripts) = self.leaf_of_path(reference, cx)?;
                    return match local {
                        Local::Record(_) => Ok(Some(local)),
                        Local::Records(fields, shape) => {
                            self.select_records(expr.span, (fields, shape), &subscripts, cx).map(Some)
                        }
                        _ => Ok(None),
                    };
                }
                let Resolved::Variable(steps) = self.tree.resolve(cx.scope, reference)? else { return Ok(None) };
                let (last, _) = steps[steps.len() - 1];
                if self.tree.instances[last].primitive.is_some() {
                    return Ok(None);
                }
                let children = self.tree.instances[last].children.clone();
                let names: Vec<Name> = children.iter().map(|&c| self.tree.instances[c].name.clone()).collect();
                let mut fields = Vec::with_capacity(names.len());
                for name in names {
                    let value = self.tree.field_of(cx.scope, expr, &name)?;
                    fields.push((name, self.local_value(&value, cx)?));
                }
                let shape = self.steps_shape(&steps, cx)?;
                Ok(Some(if shape.is_empty() { Local::Record(fields) } else { Local::Records(fields, shape) }))
            }
            ExprKind::Array(_) | ExprKind::ArrayFor(..) => self.array_of_records(expr, cx),
            ExprKind::If(branches, otherwise) => self.record_by_condition(branches, otherwise, cx),
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.as_record(only, cx),
                _ => Ok(None),
            },
            ExprKind::Call(function, Arguments::List { positional, .. })
                if self.predefined(function, cx) == Some(Builtin::Fill) =>
            {
                self.filled_records(expr.span, positional, cx)
            }
            ExprKind::Call(function, arguments) if self.makes_record(function, cx)? => {
                self.call(expr.span, function, arguments, cx).map(Some)
            }
            ExprKind::Field(record, name) => {
                let field = self.field_value(record, name, cx)?;
                Ok(matches!(field, Local::Record(_) | Local::Records(..)).then_some(field))
            }
            _ => Ok(None),
        }
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

    /// True for constructors of records and functions whose first output is of a class, not of a predefined type.
    pub(crate) fn makes_record(&mut self, function: &ComponentRef, cx: &Context) -> Result<bool, Fail> {
        if self.predefined(function, cx).is_some() {
            return Ok(false);
        }
        let (local, def) = self.called_class(function, cx)?;
        if def.kind == ClassKind::Record {
            return Ok(true);
        }
        let shape = self.tree.table.shape(local.class)?;
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = self.tree.table.class(shape.frames[element.frame as usize].class).def.clone();
            if let Element::Component(c) = &elements(&owner)[element.position as usize]
                && c.direction == Some(Direction::Output)
            {
                if simple_type(c) {
                    return Ok(false);
                }
                let inst = self.tree.package_of(&local)?;
                let found = self.tree.find_class(Scope { inst, frame: element.frame }, &c.class)?;
                return Ok(self.tree.table.class(found.class).def.kind == ClassKind::Record);
            }
        }
        Ok(false)
    }

    /// The fields of both sides of an equation between records, in pairs; `None` if neither side is a component that is one.
    /// Fields that are constants or final have their values from elsewhere.
    pub(crate) fn record_pairs(
        &mut self,
        left: &Expr,
        right: &Expr,
        cx: &mut Context,
    ) -> Result<Option<Vec<(Expr, Expr)>>, Fail> {
        let fields = match self.record_fields(left, cx) {
            Some(fields) => fields,
            None => match self.record_fields(right, cx) {
                Some(fields) => fields,
                None => return Ok(None),
            },
        };
        self.tree.check_record(cx.scope, left)?;
        self.tree.check_record(cx.scope, right)?;
        let mut pairs = Vec::with_capacity(fields.len());
        for name in fields {
            let left = self.tree.field_of(cx.scope, left, &name)?;
            pairs.push((left, self.tree.field_of(cx.scope, right, &name)?));
        }
        Ok(Some(pairs))
    }

    /// The fields that an equation determines, of a component that is a record.
    fn record_fields(&mut self, expr: &Expr, cx: &mut Context) -> Option<Vec<Name>> {
        let ExprKind::Ref(reference) = &expr.kind else { return None };
        if cx.local(&reference.parts[0].name.name).is_some() {
            return None;
        }
        let Ok(Resolved::Variable(steps)) = self.tree.resolve(cx.scope, reference) else { return None };
        let last = &self.tree.instances[steps[steps.len() - 1].0];
        if last.kind != ClassKind::Record {
            return None;
        }
        let whole = last.variability;
        let open = |child: &&hyd_instance::InstId| {
            let child = &self.tree.instances[**child];
            let is_final = child.primitive.as_ref().is_some_and(|p| p.is_final);
            child.variability == whole || child.variability > Variability::Parameter || {
                child.variability == Variability::Parameter && !is_final
            }
        };
        Some(last.children.iter().filter(open).map(|&c| self.tree.instances[c].name.clone()).collect())
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
}
