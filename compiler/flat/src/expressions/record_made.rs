//! Records made from their declarations, as expressions: constructor calls, and variables of functions (see
//! `hyd_instance::constructor`).

use hyd_instance::constructor::{RecordField, RecordMaker, construct};
use hyd_instance::{LocalClass, ScalarType, Scope, Scopes};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{Arguments, Expr as Text, Ident, Name};
use hyd_typed::{Construction, Expr, Kind};

use crate::functions::function::MAX_CALLS;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::node::Typed;

/// Fields as nodes.
pub(crate) struct Nodes<'m, 't, 's> {
    pub flat: &'m mut Flattener<'t, 's>,
    /// Where the arguments stand, or the declaration of a variable.
    pub cx: &'m mut Context,
    /// The name of the record, for messages.
    pub record: &'m str,
    /// Fields of which nothing is said are set later.
    pub set_later: bool,
}

impl Nodes<'_, '_, '_> {
    /// Surroundings of what is written in the record.
    fn inside(&self, scope: Scope, fields: &[(Name, Local)]) -> Context {
        let mut own = Context { depth: self.cx.depth + 1, ..Context::new(scope) };
        own.names = fields.to_vec();
        own.called.clone_from(&self.cx.called);
        own.called_from = self.cx.called_from;
        own.no_event = self.cx.no_event;
        own
    }

    /// An integer given to a Real field is a Real.
    fn fitted(&mut self, value: Local, field: &RecordField) -> Result<Local, Fail> {
        let real = field.declaration.class.parts.len() == 1 && &*field.declaration.class.parts[0].name == "Real";
        Ok(match value {
            Local::Index(affine) if real && affine.as_constant().is_some() => {
                let number = affine.as_constant().unwrap_or(0) as f64;
                Local::Node(self.flat.literal(number, ScalarType::Real))
            }
            Local::Node(typed) if real && matches!(typed.scalar, ScalarType::Integer) => {
                Local::Node(crate::state::node::Typed::real(typed.node))
            }
            other => other,
        })
    }
}

impl<'s> RecordMaker<'s> for Nodes<'_, '_, 's> {
    type Value = Local;
    type Fail = Fail;

    fn scopes(&mut self) -> &mut Scopes<'s> {
        self.flat.scopes
    }

    fn given(&mut self, expr: &Text, field: &RecordField) -> Result<Local, Fail> {
        let value = self.flat.value_of_text(expr, self.cx)?;
        let value = self.fitted(value, field)?;
        let named = (field.type_scope, &field.declaration);
        Ok(self.flat.claim_field(expr.span, named, self.record, value, self.cx))
    }

    fn said(
        &mut self,
        expr: &Text,
        scope: Scope,
        fields: Option<&[(Name, Local)]>,
        field: &RecordField,
    ) -> Result<Local, Fail> {
        let value = match fields {
            Some(fields) => {
                let mut own = self.inside(scope, fields);
                self.flat.value_of_text(expr, &mut own)?
            }
            None if scope.inst == self.cx.scope.inst => {
                let before = std::mem::replace(&mut self.cx.scope, scope);
                let value = self.flat.value_of_text(expr, self.cx);
                self.cx.scope = before;
                value?
            }
            None => {
                let mut own = Context { depth: self.cx.depth, ..self.inside(scope, &[]) };
                self.flat.value_of_text(expr, &mut own)?
            }
        };
        self.fitted(value, field)
    }

    fn part(&mut self, span: Span, value: Local, at: &[usize]) -> Result<Local, Fail> {
        self.flat.part_of(span, value, at)
    }

    fn sizes(&mut self, field: &RecordField, fields: &[(Name, Local)]) -> Result<Vec<usize>, Fail> {
        let mut own = self.inside(field.scope, fields);
        self.flat.sizes_of_field(field, &mut own)
    }

    fn unset(&mut self, field: &RecordField, fields: &[(Name, Local)]) -> Result<Option<Local>, Fail> {
        if !self.set_later {
            let message = format!("the field `{}` has no value", field.name);
            return Err(self.flat.error(Code::BadArguments, field.declaration.name.span, message));
        }
        let Typed { node, scalar } = self.flat.literal(0.0, ScalarType::Real);
        let mut own = self.inside(field.scope, fields);
        let form = self.flat.quietly(|flat| {
            let sizes = flat.sizes_of_field(field, &mut own)?;
            let ty = flat.elaborator(field.type_scope, None).declared_type(field.type_scope, &field.declaration)?;
            flat.declared_form(&field.declaration.name, &ty.base, &sizes, &own)
        });
        // A field whose sizes are not known here gets them when it is assigned.
        let sized = form.map(|form| form.local(&mut std::iter::repeat(node)));
        Ok(Some(sized.unwrap_or(Local::Node(Typed { node, scalar }))))
    }

    fn record(&mut self, _: &LocalClass, fields: Vec<(Name, Local)>) -> Local {
        Local::Record(fields)
    }

    fn array(&mut self, span: Span, items: Vec<Local>) -> Result<Local, Fail> {
        self.flat.stacked(span, items)
    }

    /// The fields of one record say what sizes those of none have.
    fn no_elements(&mut self, span: Span, local: &LocalClass, sizes: &[usize]) -> Result<Local, Fail> {
        if self.cx.depth >= MAX_CALLS {
            let message = format!("records are nested deeper than {MAX_CALLS} levels");
            return Err(self.flat.error(Code::Limit, span, message));
        }
        let mut cx = self.inside(self.cx.scope, &self.cx.names);
        let mut one = Nodes { flat: self.flat, cx: &mut cx, record: self.record, set_later: true };
        let one = construct(&mut one, local, Vec::new(), None)?;
        Ok(none_of(one, sizes))
    }
}

/// An array without elements of values like one.
pub(crate) fn none_of(one: Local, sizes: &[usize]) -> Local {
    let longer = |shape: Vec<usize>| sizes.iter().copied().chain(shape).collect::<Vec<_>>();
    let fields =
        |list: Vec<(Name, Local)>| list.into_iter().map(|(name, field)| (name, none_of(field, sizes))).collect();
    match one {
        Local::Record(list) => Local::Records(fields(list), sizes.to_vec()),
        Local::Records(list, shape) => Local::Records(fields(list), longer(shape)),
        Local::Array(_, shape) => Local::array(Vec::new(), longer(shape)),
        _ => Local::array(Vec::new(), sizes.to_vec()),
    }
}

impl Flattener<'_, '_> {
    /// The record of a constructor call, fields not given from the declarations.  `only`: the one field that is wanted.
    pub(crate) fn construct(
        &mut self,
        span: Span,
        made: &Construction,
        only: Option<&Name>,
        cx: &mut Context,
    ) -> Result<Local, Fail> {
        let Arguments::List { positional, named } = &*made.arguments else { return Err(Fail::Reported) };
        if cx.depth >= MAX_CALLS {
            let message = format!("functions call each other deeper than {MAX_CALLS} levels");
            return Err(self.error(Code::Limit, span, message));
        }
        let given = self.scopes.constructor_arguments(&made.record, span, positional, named)?;
        let record = self.scopes.table.class(made.record.class).def.name.name.clone();
        let outside = std::mem::replace(&mut cx.scope, made.scope);
        let result =
            construct(&mut Nodes { flat: self, cx, record: &record, set_later: false }, &made.record, given, only);
        cx.scope = outside;
        result
    }

    /// `R(...).field` where a constructor is called, without the other fields.
    pub(crate) fn field_of_constructor(
        &mut self,
        record: &Expr,
        name: &Ident,
        cx: &mut Context,
    ) -> Result<Option<Local>, Fail> {
        let Kind::Record(made) = &record.kind else { return Ok(None) };
        let whole = self.construct(record.span, made, Some(&name.name), cx)?;
        match self.fields_of(record.span, whole)?.into_iter().find(|(n, _)| *n == name.name) {
            Some((_, field)) => Ok(Some(field)),
            None => Err(self.no_field(record.span, &name.name)),
        }
    }
}
