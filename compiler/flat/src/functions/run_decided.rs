//! What only the run decides, outside functions: loops of algorithm sections, and elements at subscripts of the run.
//!
//! A `while`, or a loop with a `break`, whose turns depend on values of the run cannot be run symbolically.  The statement
//! becomes a body (see `body`): its inputs are the values of all variables it mentions, its outputs those it assigns.  An
//! element `a[k]` with `k` a variable of the run is a body too: the elements and the subscripts go in, one element comes out.
//! Inside, relations cause no events.

use hyd_instance::ScalarType;
use hyd_source::Code;
use hyd_symbolic::Step;
use hyd_syntax::tree::{Name, Variability};
use hyd_typed::{Base, Expr, Kind, Statement};

use crate::expressions::computed::{Input, without_last_subscripts};
use crate::functions::rename::{Found, rename};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::form::Form;

/// A value that goes into the statement under one name.
struct Value {
    /// The name inside: the text outside.
    name: Name,
    /// What it is outside.
    expr: Expr,
    /// The type, where it is a variable of the model.
    scalar: Option<ScalarType>,
    /// The statement assigns it.
    set: bool,
}

impl Flattener<'_, '_> {
    /// Runs a statement of an algorithm section as a body.
    pub(crate) fn run_compiled(&mut self, statement: &Statement, cx: &mut Context) -> Result<(), Fail> {
        let mut inside = statement.clone();
        let mut values: Vec<Value> = Vec::new();
        let mut failed = None;
        rename(&mut inside, &mut |found| match (failed, self.value_for(found, cx, &mut values)) {
            (None, Ok(name)) => name,
            (None, Err(fail)) => {
                failed = Some(fail);
                None
            }
            _ => None,
        });
        if let Some(fail) = failed {
            return Err(fail);
        }
        let mut inputs: Vec<Input> = Vec::new();
        for value in &values {
            let local = self.local_value(&value.expr, cx)?;
            inputs.push((value.name.clone(), self.form_outside(value, &local)?, local));
        }
        let results = self.own_body("algorithm", statement.span, &inputs, cx, |flat, inner| {
            // What is assigned gets registers of its own: inputs keep their values.
            let mut outputs = Vec::new();
            for ((name, form, _), _) in inputs.iter().zip(&values).filter(|(_, value)| value.set) {
                let before = inner.local(name).cloned().ok_or(Fail::Reported)?;
                let mut nodes = Vec::new();
                flat.nodes_of(statement.span, form, &before, &mut nodes)?;
                let own = flat.registers(nodes.len());
                own.clone().zip(nodes).for_each(|(register, node)| flat.step(Step::Set(register, node)));
                let local = flat.over_registers(form, own.clone());
                inner.names.retain(|(n, _)| n != name);
                inner.names.push((name.clone(), local));
                outputs.extend(own);
            }
            flat.build_statement(&inside, inner)?;
            Ok(outputs)
        })?;
        let mut results = results.into_iter();
        for ((_, form, _), value) in inputs.iter().zip(&values).filter(|(_, value)| value.set) {
            if let Kind::Variable(variable) = &value.expr.kind {
                self.assign_variable(&value.expr, variable, form.local(&mut results), cx)?;
            }
        }
        Ok(())
    }

    /// The name inside for a reference or call outside; `None` if it means the same inside.
    fn value_for(&mut self, found: Found<'_>, _cx: &Context, values: &mut Vec<Value>) -> Result<Option<Name>, Fail> {
        let (expr, set, hidden) = match found {
            Found::Operator(expr) => {
                return Ok(Some(note(
                    Value { name: text_of(expr), expr: expr.clone(), scalar: None, set: false },
                    values,
                )));
            }
            Found::Reference(expr, set, hidden) => (expr, set, hidden),
        };
        let whole = without_last_subscripts(expr);
        if let Some(at) = subscripts_of(&whole).find(|e| hidden.iter().any(|name| hyd_typed::mentions(e, name))) {
            let message = "a component at a subscript that only the run decides cannot be named here";
            return Err(self.error(Code::OutsideProfile, at.span, message));
        }
        let scalar = match &expr.kind {
            Kind::Local(_) => None,
            Kind::Variable(variable) => {
                let instance = &self.scopes.instances[variable.last()];
                if instance.variability == Variability::Constant || expr.ty.is_text() {
                    return Ok(None);
                }
                match &expr.ty.base {
                    Base::Scalar(scalar) => Some(scalar.clone()),
                    _ => {
                        let message = format!(
                            "`{}` is not a number; name its elements in a statement that only the run decides",
                            hyd_syntax::print_reference(&variable.reference)
                        );
                        return Err(self.error(Code::OutsideProfile, expr.span, message));
                    }
                }
            }
            _ => Some(ScalarType::Real),
        };
        Ok(Some(note(Value { name: text_of(&whole), expr: whole, scalar, set }, values)))
    }

    fn form_outside(&mut self, value: &Value, local: &Local) -> Result<Form, Fail> {
        let typed = |given: &ScalarType| value.scalar.clone().unwrap_or_else(|| given.clone());
        Ok(match local {
            Local::Array(items, shape) => {
                Form::Array(typed(items.first().map_or(&ScalarType::Real, |item| &item.scalar)), shape.clone())
            }
            single => {
                let scalar = self.as_node(value.expr.span, single)?.scalar;
                Form::Scalar(typed(&scalar))
            }
        })
    }
}

/// Adds a value unless its name is there; the name.
fn note(value: Value, values: &mut Vec<Value>) -> Name {
    let name = value.name.clone();
    match values.iter_mut().find(|known| known.name == name) {
        Some(known) => known.set |= value.set,
        None => values.push(value),
    }
    name
}

fn text_of(expr: &Expr) -> Name {
    hyd_syntax::print_expr(&expr.written()).into()
}

fn subscripts_of(expr: &Expr) -> Box<dyn Iterator<Item = &Expr> + '_> {
    match &expr.kind {
        Kind::Variable(variable) => Box::new(variable.steps.iter().flat_map(|(_, subscripts)| subscripts)),
        Kind::Local(local) => Box::new(local.parts.iter().flat_map(|(_, subscripts)| subscripts)),
        _ => Box::new(std::iter::empty()),
    }
}
