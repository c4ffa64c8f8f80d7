//! Variables: attributes and bindings gathered from all that is said of them, bindings of records taken apart.
//!
//! For each attribute and for the binding the outermost modification counts (Modelica 3.6, section 7.2.4).

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, did_you_mean};
use hyd_syntax::tree::{ClassKind, Expr, ExprKind, Name, Variability};

use crate::classes::modifier::{Applied, AstMod, Mods, of_child};
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, LocalClass, Primitive, ScalarType, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::target::name_in;

/// What the outermost of these modifications says of a field, if that is final.
fn final_value(mods: &[Applied], name: &Name) -> Option<Applied> {
    mods.iter().find_map(|applied| {
        let (_, tree) = applied.tree.children.iter().find(|(child, _)| child == name)?;
        let is_value = tree.is_final && tree.binding.is_some();
        is_value.then(|| Applied { spread: applied.spread.clone(), ..Applied::new(tree.clone(), applied.scope) })
    })
}

impl Scopes<'_> {
    /// Bindings of a component of a class (a record) become bindings of its fields.  The first `outside` modifications are not
    /// those of the class itself.
    pub(crate) fn take_apart(
        &mut self,
        local: &LocalClass,
        mods: &mut Mods,
        outside: usize,
        shape: &Rc<Shape>,
    ) -> Result<(), Reported> {
        if mods.iter().all(|applied| applied.tree.binding.is_none()) {
            return Ok(());
        }
        let record = self.table.class(local.class).def.kind == ClassKind::Record;
        let inputs = if record { Some(self.inputs_of_constructor(local)?) } else { None };
        // What is final keeps its value.
        let open = |name: &Name| inputs.as_ref().is_none_or(|inputs| inputs.iter().any(|input| input.name == *name));
        for k in 0..mods.len() {
            let Some(expr) = mods[k].tree.binding.clone() else { continue };
            let scope = mods[k].scope;
            self.check_record(scope, &expr)?;
            let mut children = mods[k].tree.children.clone();
            for element in shape.elements.iter().filter(|e| e.component && open(&e.name)) {
                let name = &element.name;
                let inner = mods.get(k + 1..outside).unwrap_or(&[]);
                let said = |m: &Applied| m.tree.binding.is_some() || m.tree.children.iter().any(|(n, _)| n == name);
                // The default of the declaration stays, and with it what it depends on.
                if !inner.iter().any(said) && self.leaves_out(scope, &expr, local.class, name)? {
                    continue;
                }
                let value = self.field_of(scope, &expr, name)?;
                if let Some(own) = final_value(inner, name) {
                    self.same_as_final(name, &value, scope, &own)?;
                    continue;
                }
                let said = children.iter().any(|(n, child)| n == name && child.binding.is_some());
                if said && matches!(value.kind, ExprKind::Field(..)) {
                    continue;
                }
                children.push((name.clone(), Arc::new(AstMod::of_binding(value))));
            }
            let applied = &mut mods[k];
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

    /// A field that is final keeps its value under a record bound as a whole, which must have the same (7.2.6).
    fn same_as_final(&mut self, name: &Name, value: &Expr, scope: Scope, own: &Applied) -> Result<(), Reported> {
        let tree = Arc::new(AstMod::of_binding(value.clone()));
        let given = Applied::new(tree, scope);
        let [given, kept] = [&given, own].map(|applied| self.quietly(|scopes| scopes.guess_applied(applied)).ok());
        if given.is_some() && given == kept {
            return Ok(());
        }
        self.final_modified(name, Some(value.span), own.tree.span);
        Err(Reported)
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
                    let attributes = ATTRIBUTES.iter().copied();
                    diagnostic = match tree.span {
                        Some(span) => {
                            let place = name_in(&self.table.files, span, name);
                            diagnostic.at(span, "names nothing").meant(place, name, attributes)
                        }
                        None => diagnostic.maybe_help(did_you_mean(name, attributes)),
                    };
                    self.table.report(diagnostic);
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
        let binding = crate::classes::modifier::binding(mods).cloned();
        let is_final = is_final || binding.as_ref().is_some_and(|b| b.tree.is_final);
        if scalar == ScalarType::Object {
            // An external object is made before the run and stays what it is (12.9.7).
            let declared = self.instances[inst].variability;
            self.instances.edit(inst).variability = declared.min(Variability::Parameter);
        }
        if !matches!(scalar, ScalarType::Real) && self.instances[inst].variability == Variability::Continuous {
            self.instances.edit(inst).variability = Variability::Discrete;
        }
        self.instances.edit(inst).primitive = Some(Primitive { scalar, attributes, binding, is_final });
    }
}
