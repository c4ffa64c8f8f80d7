//! Functions of the user: their declarations and algorithms in their own scope.

use std::rc::Rc;

use hyd_instance::shape::Shape;
use hyd_instance::{FunctionComponent, InstId, LocalClass, Scope};
use hyd_source::Reported;
use hyd_syntax::tree::{ClassBody, ComponentRef, Direction, Expr, ExprKind, External, Name};

use crate::elaborate::Elaborator;
use crate::function::{self, Declaration, Function, Signature};
use crate::types::Type;

impl Elaborator<'_, '_> {
    /// What a call needs to know of a function.
    ///
    /// # Errors
    /// When a declaration of it has no type; reported.
    pub fn signature(&mut self, local: &LocalClass) -> Result<Rc<Signature>, Reported> {
        let inst = self.scopes.package_of(local)?;
        if let Some(known) = self.typing.signatures.get(&inst) {
            return Ok(known.clone());
        }
        self.typing.open.push(inst);
        let signature = self.signature_of(inst, local);
        self.typing.open.pop();
        let signature = Rc::new(signature?);
        self.typing.signatures.insert(inst, signature.clone());
        Ok(signature)
    }

    fn signature_of(&mut self, inst: InstId, local: &LocalClass) -> Result<Signature, Reported> {
        let shape = self.scopes.table.shape(local.class)?;
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for FunctionComponent { frame, component, .. } in self.scopes.function_components(inst, &shape)? {
            let list = match component.direction {
                Some(Direction::Input) => &mut inputs,
                Some(Direction::Output) => &mut outputs,
                None => continue,
            };
            let ty = self.declared_type(Scope { inst, frame }, &component)?;
            list.push((component.name.name.clone(), ty));
        }
        Ok(Signature { inst, inputs, outputs })
    }

    /// A function with all its declarations and statements.
    ///
    /// # Errors
    /// When a declaration of it has no type; reported.
    pub fn function(&mut self, local: &LocalClass) -> Result<Rc<Function>, Reported> {
        let inst = self.scopes.package_of(local)?;
        if let Some(known) = self.typing.functions.get(&inst) {
            return Ok(known.clone());
        }
        let shape = self.scopes.table.shape(local.class)?;
        let components = self.scopes.function_components(inst, &shape)?;
        let mut locals: Vec<(Name, Type)> = Vec::with_capacity(components.len());
        for FunctionComponent { frame, component, .. } in &components {
            let ty = self.declared_type(Scope { inst, frame: *frame }, component)?;
            locals.push((component.name.name.clone(), ty));
        }
        let mut inside = Elaborator {
            scopes: &mut *self.scopes,
            typing: &mut *self.typing,
            scope: Scope { inst, frame: 0 },
            locals,
            in_function: true,
            in_when: false,
        };
        let function = Rc::new(inside.whole_function(local, shape, components));
        self.typing.functions.insert(inst, function.clone());
        Ok(function)
    }

    fn external(&mut self, text: &External) -> function::External {
        let (mut output, mut arguments) = (None, Vec::new());
        if let Some(call) = &text.call {
            let reference = |reference: &ComponentRef| ExprKind::Ref(reference.clone());
            output = call.output.as_ref().map(|name| self.deferred(&Expr { kind: reference(name), span: name.span }));
            arguments = call.arguments.iter().map(|argument| self.deferred(argument)).collect();
        }
        function::External { text: text.clone(), output, arguments }
    }

    fn whole_function(&mut self, local: &LocalClass, shape: Rc<Shape>, components: Vec<FunctionComponent>) -> Function {
        let inst = self.scope.inst;
        let types: Vec<Type> = self.locals.iter().map(|(_, ty)| ty.clone()).collect();
        let place = |name: &Name| components.iter().position(|own| own.component.name.name == *name);
        let ordered = hyd_instance::in_order_of_values(components.clone());
        let others = ordered.iter().filter(|own| own.component.direction != Some(Direction::Input));
        let order = others.filter_map(|own| place(&own.component.name.name)).collect();
        let mut variables = Vec::with_capacity(components.len());
        for (FunctionComponent { frame, component: text, value_scope }, ty) in components.into_iter().zip(types) {
            // The values of inputs are those of the class as a whole.
            let input = text.direction == Some(Direction::Input);
            self.scope.frame = if input { 0 } else { frame };
            let mut dims: Vec<_> = text.dims.iter().map(|dim| self.deferred(dim)).collect();
            dims.extend(self.dims_of_type(Scope { inst, frame }, &text));
            let value = text.modification.binding.as_ref().map(|value| match value_scope {
                Some(around) => {
                    Elaborator::new(&mut *self.scopes, &mut *self.typing, around, Vec::new()).deferred(value)
                }
                None => self.deferred(value),
            });
            let (name, direction, variability) = (text.name.clone(), text.direction, text.variability);
            variables.push(Declaration { name, frame, direction, variability, ty, dims, value, text });
        }
        let (mut algorithms, mut external, mut equation) = (Vec::new(), None, None);
        for (frame, part) in shape.frames.iter().enumerate() {
            let owner = self.scopes.table.class(part.class).def.clone();
            let ClassBody::Long { algorithms: own, external: outside, equations, .. } = &owner.body else { continue };
            equation = equation.or(equations.iter().find_map(|section| section.equations.first()).map(|e| e.span));
            self.scope.frame = frame as u32;
            if let (None, Some(outside)) = (&external, outside) {
                match self.scopes.written_call(outside, variables.iter().map(|variable| &variable.text)) {
                    Some(statement) => {
                        let statements = self.statements(std::slice::from_ref(&statement));
                        algorithms.push((frame as u32, statements));
                    }
                    None => external = Some(self.external(outside)),
                }
            }
            for section in own {
                algorithms.push((frame as u32, self.statements(&section.statements)));
            }
        }
        let def = self.scopes.table.class(local.class).def.clone();
        Function { inst, class: local.clone(), def, shape, variables, algorithms, external, equation, order }
    }
}
