//! Records inside expressions and functions: constructors, fields, and what makes a record.

use hyd_instance::class::elements;
use hyd_instance::record::{Field, field, making_call};
use hyd_instance::{LocalClass, Resolved, ScalarType, Scope};
use hyd_source::Code;
use hyd_syntax::tree::{ClassKind, Component, ComponentRef, Direction, Element, Expr, ExprKind, Name};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::function::simple_type;
use crate::index::Affine;
use crate::lower::Typed;

impl Flattener<'_, '_> {
    /// A record expression as its fields; `None` if the expression is no record.
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
                for (position, name) in names.iter().enumerate() {
                    if let Field::Expr(value) = field(expr, name, position, true) {
                        fields.push((name.clone(), self.local_value(&value, cx)?));
                    }
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
            ExprKind::Call(function, arguments) if self.makes_record(function, cx)? => {
                self.call(expr.span, function, arguments, cx).map(Some)
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
        let simple = function.parts.len() == 1 && !function.global;
        if simple && crate::call::is_predefined(&function.parts[0].name.name) {
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

    /// The record of a constructor call, fields not given from the declarations.
    pub(crate) fn construct(&mut self, local: &LocalClass, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        self.tree.check_constructor(local.class, expr)?;
        let shape = self.tree.table.shape(local.class)?;
        let inst = self.tree.package_of(local)?;
        let mut fields: Vec<(Name, Local)> = Vec::new();
        for (position, element) in shape.elements.iter().filter(|e| e.component).enumerate() {
            let owner = self.tree.table.class(shape.frames[element.frame as usize].class).def.clone();
            let Element::Component(declaration) = &elements(&owner)[element.position as usize] else { continue };
            let value = match field(expr, &element.name, position, true) {
                Field::Expr(value) => {
                    let local = self.local_value(&value, cx)?;
                    let named = (Scope { inst, frame: element.frame }, declaration);
                    self.claim_field(value.span, named, &owner.name.name, local, cx)
                }
                _ => {
                    let mut own = Context { depth: cx.depth + 1, ..Context::new(Scope { inst, frame: element.frame }) };
                    own.names.clone_from(&fields);
                    match &declaration.modification.binding {
                        Some(default) => self.local_value(&default.clone(), &mut own)?,
                        None => {
                            let message = format!("the field `{}` has no value", element.name);
                            return Err(self.error(Code::BadArguments, expr.span, message));
                        }
                    }
                }
            };
            fields.push((element.name.clone(), value));
        }
        Ok(Local::Record(fields))
    }

    /// The fields of a record-valued expression as expressions; `None` if it is no record.
    pub(crate) fn record_fields(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Vec<Name>>, Fail> {
        match &expr.kind {
            ExprKind::Ref(reference) => {
                if cx.local(&reference.parts[0].name.name).is_some() {
                    return Ok(None);
                }
                let Ok(Resolved::Variable(steps)) = self.tree.resolve(cx.scope, reference) else { return Ok(None) };
                let last = &self.tree.instances[steps[steps.len() - 1].0];
                if last.kind != ClassKind::Record {
                    return Ok(None);
                }
                Ok(Some(last.children.iter().map(|&c| self.tree.instances[c].name.clone()).collect()))
            }
            _ => Ok(None),
        }
    }

    /// True if calls that make the record in `expr` are constructors.
    pub(crate) fn by_constructor(&mut self, expr: &Expr, cx: &Context) -> Result<bool, Fail> {
        match making_call(expr) {
            None => Ok(true),
            Some(function) => {
                let function = function.clone();
                Ok(self.called_class(&function, cx)?.1.kind != ClassKind::Function)
            }
        }
    }

    /// `call.field`
    pub(crate) fn lower_field(
        &mut self,
        record: &Expr,
        name: &Name,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let local = self.field_value(record, name, cx)?;
        self.element_of_local(record.span, &local, index)
    }

    pub(crate) fn field_value(&mut self, record: &Expr, name: &Name, cx: &mut Context) -> Result<Local, Fail> {
        let value = self.local_value(record, cx)?;
        let fields = self.fields_of(record.span, value)?;
        match fields.into_iter().find(|(n, _)| n == name) {
            Some((_, local)) => Ok(local),
            None => Err(self.error(Code::TypeMismatch, record.span, format!("the record has no field `{name}`"))),
        }
    }

    /// A local record before its fields are set.
    pub(crate) fn empty_record(&mut self, component: &Component, inner: &mut Context) -> Result<Option<Local>, Fail> {
        let local = self.tree.find_class(inner.scope, &component.class)?;
        if self.tree.table.class(local.class).def.kind != ClassKind::Record {
            return Ok(None);
        }
        let mark = self.tree.table.diagnostics.len();
        let sizes = self.local_sizes(component, inner)?;
        let zero = self.literal(0.0, ScalarType::Real);
        if let Ok(form) = self.declared_form(component, sizes, inner) {
            return Ok(Some(form.local(&mut std::iter::repeat(zero.node))));
        }
        // Fields whose sizes are not known here get them when they are assigned.
        self.tree.table.diagnostics.truncate(mark);
        let shape = self.tree.table.shape(local.class)?;
        let fields = shape.elements.iter().filter(|e| e.component).map(|e| (e.name.clone(), Local::Node(zero.clone())));
        Ok(Some(Local::Record(fields.collect())))
    }
}
