//! Variables: attributes and bindings gathered from all that is said of them, bindings of records taken apart.
//!
//! For each attribute and for the binding the outermost modification counts (Modelica 3.6, section 7.2.4).

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, did_you_mean};
use hyd_syntax::tree::{ClassKind, Name, Variability};

use crate::build::InstanceTree;
use crate::instance::{InstId, Primitive, ScalarType};
use crate::lookup::Resolved;
use crate::modifier::{Applied, AstMod, Mods, of_child};
use crate::record::{Field, field, making_call};
use crate::shape::Shape;

impl InstanceTree<'_> {
    /// Bindings of a component of a class (a record) become bindings of its fields.
    pub(crate) fn take_apart(&mut self, mods: &mut Mods, shape: &Rc<Shape>) -> Result<(), Reported> {
        for applied in mods.iter_mut() {
            let Some(expr) = applied.tree.binding.clone() else { continue };
            let constructor = match making_call(&expr).cloned() {
                None => true,
                Some(function) => match self.resolve(applied.scope, &function)? {
                    Resolved::Class(local) if self.table.class(local.class).def.kind == ClassKind::Function => false,
                    Resolved::Class(local) => {
                        self.check_constructor(local.class, &expr)?;
                        true
                    }
                    _ => true,
                },
            };
            let mut children = applied.tree.children.clone();
            for (position, element) in shape.elements.iter().filter(|e| e.component).enumerate() {
                match field(&expr, &element.name, position, constructor) {
                    Field::Expr(value) => {
                        children.push((element.name.clone(), Arc::new(AstMod::of_binding(value))));
                    }
                    Field::Default => {}
                    Field::Unknown => {
                        let message =
                            "a value of a record must be a record, its constructor, or a function that gives one";
                        self.table.report(Diagnostic::error(Code::TypeMismatch, message).at(expr.span, ""));
                        return Err(Reported);
                    }
                }
            }
            applied.tree = Arc::new(AstMod {
                binding: None,
                each: applied.tree.each,
                is_final: applied.tree.is_final,
                redeclare: None,
                children,
                span: applied.tree.span,
            });
        }
        Ok(())
    }

    pub(crate) fn make_variable(&mut self, inst: InstId, scalar: ScalarType, mods: &Mods, is_final: bool) {
        const ATTRIBUTES: &[&str] =
            &["quantity", "unit", "displayUnit", "min", "max", "start", "fixed", "nominal", "unbounded", "stateSelect"];
        let array = (!self.instances[inst].dims.is_empty()).then_some(inst);
        let mut attributes: Vec<(Name, Applied)> = Vec::new();
        for applied in mods {
            self.check_said_twice(&applied.tree);
            self.check_each(inst, applied);
            for (name, tree) in &applied.tree.children {
                if !ATTRIBUTES.contains(&name.as_ref()) {
                    let message = format!(
                        "`{}` is a {} variable and has no attribute `{name}`",
                        self.instances[inst].name,
                        scalar.name()
                    );
                    let mut diagnostic = Diagnostic::error(Code::UnknownModifier, message);
                    if let Some(span) = tree.span {
                        diagnostic = diagnostic.at(span, "names nothing");
                    }
                    let help = did_you_mean(name, ATTRIBUTES.iter().copied());
                    self.table.report(diagnostic.maybe_help(help));
                    continue;
                }
                if let Some((_, outer)) = attributes.iter().find(|(known, _)| known == name) {
                    if tree.is_final {
                        let outer = outer.tree.span;
                        self.final_modified(name, outer, tree.span);
                    }
                    continue;
                }
                let only = vec![applied.clone()];
                if let Some(found) = of_child(&only, name, array).into_iter().next() {
                    attributes.push((name.clone(), found));
                }
            }
        }
        let binding = crate::modifier::binding(mods).cloned();
        let is_final = is_final || binding.as_ref().is_some_and(|b| b.tree.is_final);
        if !matches!(scalar, ScalarType::Real) && self.instances[inst].variability == Variability::Continuous {
            self.instances[inst].variability = Variability::Discrete;
        }
        self.instances[inst].primitive = Some(Primitive { scalar, attributes, binding, is_final });
    }
}
