//! Variables of functions that are being run or compiled: sizes and forms from their declarations.

use std::sync::Arc;

use hyd_instance::constructor::{Said, declared};
use hyd_instance::modifier::AstMod;
use hyd_instance::{ScalarType, Scope, Value};
use hyd_source::Code;
use hyd_syntax::tree::{ClassKind, Component, Element};
use hyd_typed::{Base, Declaration, Function};

use crate::expressions::record_made::Nodes;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::form::Form;

impl Flattener<'_, '_> {
    /// The sizes of a local or output; those of `v[:]` are read off its declaration's value or the first assignment to it.
    pub(crate) fn sizes_in_body(
        &mut self,
        callee: &Function,
        component: &Declaration,
        inner: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        if !component.is_sized_by_value() {
            return self.local_sizes(component, inner);
        }
        let name = &component.name.name;
        match component.value.as_ref().or_else(|| callee.first_value(name)) {
            Some(value) => self.shape(value, inner),
            None => {
                let message = format!("nothing gives `{name}` a size: it is assigned as a whole nowhere");
                Err(self.error(Code::ArrayShape, component.name.span, message))
            }
        }
    }

    /// Type and sizes of a local or output, from its declaration.
    pub(crate) fn declared_form(
        &mut self,
        component: &Component,
        sizes: Vec<usize>,
        inner: &mut Context,
    ) -> Result<Form, Fail> {
        // A text is known where it is used, or there is no body.
        if component.class.parts.len() == 1 && component.class.parts[0].name.as_ref() == "String" && sizes.is_empty() {
            return Ok(Form::Fixed(Value::Text("".into())));
        }
        let scalar = match component.class.parts.as_slice() {
            [only] => match only.name.as_ref() {
                "Real" => Some(ScalarType::Real),
                "Integer" => Some(ScalarType::Integer),
                "Boolean" => Some(ScalarType::Boolean),
                _ => None,
            },
            _ => None,
        };
        let form = match scalar {
            Some(scalar) => Form::Scalar(scalar),
            None => self.class_form(component, inner)?,
        };
        Ok(if sizes.is_empty() { form } else { form.repeated(&sizes) })
    }

    /// The form of a class: an alias of a predefined type, an enumeration or a record.
    pub(crate) fn class_form(&mut self, component: &Component, inner: &mut Context) -> Result<Form, Fail> {
        let local = self.scopes.find_class(inner.scope, &component.class)?;
        if let Some(enumeration) = self.scopes.enumeration(local.class) {
            return Ok(Form::Scalar(ScalarType::Enumeration(enumeration)));
        }
        let shape = self.scopes.table.shape(local.class)?;
        match shape.builtin.as_deref() {
            Some("Real") => return Ok(Form::Scalar(ScalarType::Real)),
            Some("Integer") => return Ok(Form::Scalar(ScalarType::Integer)),
            Some("Boolean") => return Ok(Form::Scalar(ScalarType::Boolean)),
            _ => {}
        }
        if self.scopes.table.class(local.class).def.kind != ClassKind::Record {
            let message = format!("`{}` cannot be a variable of a function", component.name.name);
            return Err(self.error(Code::TypeMismatch, component.name.span, message));
        }
        let inst = self.scopes.package_of(&local)?;
        let mut fields = Vec::new();
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = self.scopes.table.class(shape.frames[element.frame as usize].class).def.clone();
            let declared = &hyd_instance::class::elements(&owner)[element.position as usize];
            if let Element::Component(field) = declared {
                let scope = Scope { inst, frame: element.frame };
                let mut own = Context { depth: inner.depth, ..Context::new(scope) };
                let sizes = self.sizes_of_text(field, &mut own)?;
                fields.push((element.name.clone(), self.declared_form(field, sizes, &mut own)?));
            }
        }
        Ok(Form::Record(fields))
    }

    pub(crate) fn declare_local(
        &mut self,
        component: &Declaration,
        callee: &Function,
        inner: &mut Context,
    ) -> Result<(), Fail> {
        let modified = !component.text.modification.arguments.is_empty();
        if (modified || component.value.is_none())
            && !component.is_simple()
            && let Some(record) = self.declared_record(component, callee, inner)?
        {
            inner.names.push((component.name.name.clone(), record));
            return Ok(());
        }
        let local = match &component.value {
            Some(binding) => {
                let local = self.local_value(binding, inner)?;
                self.claim_assigned(binding.span, &component.name.name, local, inner)
            }
            None if component.is_fixed() || !component.is_simple() => return Ok(()),
            // `v[:]` has the size of what is assigned to it.
            None if component.is_sized_by_value() => return Ok(()),
            None => {
                let sizes = self.local_sizes(component, inner)?;
                if sizes.is_empty() {
                    return Ok(());
                }
                let Base::Scalar(scalar) = component.ty.base.clone() else { return Ok(()) };
                let zero = self.literal(0.0, scalar);
                Local::array(vec![zero; sizes.iter().product()], sizes)
            }
        };
        inner.names.push((component.name.name.clone(), local));
        Ok(())
    }

    /// A variable of a function that is a record, or an array of records, as its declaration has it; `None` for another type.
    pub(crate) fn declared_record(
        &mut self,
        declared_as: &Declaration,
        function: &Function,
        inner: &mut Context,
    ) -> Result<Option<Local>, Fail> {
        let component = &declared_as.text;
        let local = self.scopes.find_class(inner.scope, &component.class)?;
        if self.scopes.table.class(local.class).def.kind != ClassKind::Record || declared_as.is_sized_by_value() {
            return Ok(None);
        }
        let sizes = self.local_sizes(declared_as, inner)?;
        let mut said = Vec::new();
        // What a short definition or an `extends` clause of the function says of it.
        for (frame, tree) in &function.shape.frames[inner.scope.frame as usize].modifications {
            let scope = Scope { inst: inner.scope.inst, frame: *frame };
            let own = tree.children.iter().filter(|(name, _)| *name == component.name.name);
            said.extend(own.map(|(_, tree)| Said { tree: tree.clone(), scope, at: Vec::new() }));
        }
        let tree = Arc::new(AstMod::from_syntax(&component.modification));
        said.push(Said { tree, scope: inner.scope, at: Vec::new() });
        let record = self.scopes.table.class(local.class).def.name.name.clone();
        let mut maker = Nodes { flat: self, cx: inner, record: &record, set_later: true };
        declared(&mut maker, &local, &said, &sizes, component.name.span).map(Some)
    }
}
