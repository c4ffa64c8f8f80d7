//! Variables of functions that are being run or compiled: sizes and forms from their declarations.

use std::sync::Arc;

use hyd_instance::constructor::{Said, declared};
use hyd_instance::modifier::AstMod;
use hyd_instance::{ScalarType, Scope, Value};
use hyd_source::Code;
use hyd_syntax::tree::{ClassKind, Ident};
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

    /// The form of a variable with these sizes, from the type that its declaration gives.
    pub(crate) fn declared_form(
        &mut self,
        name: &Ident,
        base: &Base,
        sizes: &[usize],
        inner: &Context,
    ) -> Result<Form, Fail> {
        let form = match base {
            // A text is known where it is used, or there is no body.
            Base::Scalar(ScalarType::Text) if sizes.is_empty() => return Ok(Form::Fixed(Value::Text("".into()))),
            Base::Scalar(ScalarType::Text | ScalarType::Object) | Base::Function(_) | Base::None => {
                let message = format!("`{}` cannot be a variable of a function", name.name);
                return Err(self.error(Code::TypeMismatch, name.span, message));
            }
            Base::Scalar(scalar) => Form::Scalar(scalar.clone()),
            Base::Record(record) => {
                let dims = self.typing.dims_of_fields(record);
                let mut fields = Vec::with_capacity(record.fields.len());
                for ((field, ty), (frame, dims)) in record.fields.iter().zip(&*dims) {
                    let inst = record.inst.unwrap_or(inner.scope.inst);
                    let mut own = Context { depth: inner.depth, ..Context::new(Scope { inst, frame: *frame }) };
                    let sizes = self.sizes_of_dims(dims, &mut own)?;
                    let name = Ident { name: field.clone(), span: name.span };
                    fields.push((field.clone(), self.declared_form(&name, &ty.base, &sizes, inner)?));
                }
                Form::Record(fields)
            }
        };
        Ok(if sizes.is_empty() { form } else { form.repeated(sizes) })
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
