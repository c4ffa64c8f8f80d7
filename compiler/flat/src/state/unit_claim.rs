//! Units that are declared where no variable of the model stands.
//!
//! Constants with a unit are numbers of the pool that carry it ([`Quantity`]).  What a function declares of its inputs and
//! outputs, and a record of the fields that its constructor fills, becomes a claim on the value that stands there in the call
//! ([`UnitClaim`]): the unit check looks at it like at an equation, all other stages do not see it.  The inside of a compiled
//! function is not looked at.

use std::rc::Rc;
use std::sync::Arc;

use hyd_instance::{InstId, ScalarType, Scope, Value};
use hyd_source::{Origin, Span};
use hyd_symbolic::BodyId;
use hyd_syntax::tree::{Component, Direction, Name};
use hyd_typed::Function;

use crate::model::{Quantity, Section, UnitClaim};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::SlotKey;
use crate::state::node::Typed;

/// The declarations of a function that give a unit.
pub(crate) type FunctionUnits = Rc<Vec<Declared>>;

/// A declaration with a unit.
#[derive(Clone)]
pub(crate) struct Declared {
    pub name: Name,
    pub direction: Option<Direction>,
    pub unit: Arc<str>,
    pub span: Span,
}

impl Flattener<'_, '_> {
    /// A constant: a literal, or a number with its unit.
    pub(crate) fn constant_of(&mut self, span: Span, inst: InstId, value: &Value, k: usize) -> Result<Typed, Fail> {
        let (Value::Real(number), true) = (value, self.builders.is_empty()) else {
            return self.constant_value(span, value);
        };
        let Some(unit) = self.unit_of_constant(inst, k) else { return self.constant_value(span, value) };
        let name = self.path(inst);
        Ok(self.quantity(*number, &unit, name, self.scopes.instances[inst].span))
    }

    /// A number with a unit as a slot.
    fn quantity(&mut self, value: f64, unit: &Arc<str>, name: Arc<str>, declared: Span) -> Typed {
        let key = (declared, value.to_bits(), unit.clone());
        let id = match self.quantities.get(&key) {
            Some(&known) => known,
            None => {
                let id = self.model.constants.push(value);
                self.model.quantities.push(Quantity { id, unit: unit.clone(), name, declared });
                self.quantities.insert(key, id);
                id
            }
        };
        let slot = self.slots.slot(SlotKey::Quantity(id));
        Typed { node: self.model.templates.arena.slot(slot), scalar: ScalarType::Real }
    }

    /// A literal takes the unit of what it is given to, so that it counts in products; zero fits everywhere.
    fn adopt(&mut self, declared: &Declared, value: Local) -> Local {
        if declared.unit.as_ref() == "1" {
            return value;
        }
        let mut number = |typed: Typed| match self.model.templates.arena.as_constant(typed.node) {
            Some(number) if number != 0.0 => {
                let text = hyd_symbolic::format_number(number).into();
                self.quantity(number, &declared.unit, text, declared.span)
            }
            _ => typed,
        };
        match value {
            Local::Node(typed) => Local::Node(number(typed)),
            Local::Array(items, shape) => Local::array(items.iter().cloned().map(number).collect(), shape),
            Local::Index(affine) => match affine.as_constant() {
                Some(k) if k != 0 => {
                    let typed = self.literal(k as f64, ScalarType::Real);
                    self.adopt(declared, Local::Node(typed))
                }
                _ => Local::Index(affine),
            },
            Local::Value(Value::Real(x)) => {
                let typed = self.literal(x, ScalarType::Real);
                self.adopt(declared, Local::Node(typed))
            }
            other => other,
        }
    }

    /// The unit a constant declares, unless it is that of a plain number.
    fn unit_of_constant(&mut self, inst: InstId, k: usize) -> Option<Arc<str>> {
        let applied = self.attribute(inst, "unit")?;
        let value = self.scopes.quietly(|scopes| scopes.evaluate_applied(&applied)).ok()?;
        let all = value.flatten();
        match all.get(k).or(all.first()) {
            Some(Value::Text(text)) if !text.is_empty() && text.as_ref() != "1" => Some(text.clone()),
            _ => None,
        }
    }

    /// The declarations of a function that give a unit.
    pub(crate) fn units_of_function(&mut self, callee: &Function) -> FunctionUnits {
        if let Some(known) = self.function_units.get(&callee.inst) {
            return known.clone();
        }
        let mut found = Vec::new();
        for variable in &callee.variables {
            let scope = Scope { inst: callee.inst, frame: variable.frame };
            if let Some(unit) = self.scopes.declared_unit(scope, &variable.text) {
                let (name, span) = (variable.name.name.clone(), variable.name.span);
                found.push(Declared { name, direction: variable.direction, unit, span });
            }
        }
        let found = Rc::new(found);
        self.function_units.insert(callee.inst, found.clone());
        found
    }

    /// The inputs of a call have the units that the function declares.
    pub(crate) fn claim_inputs(
        &mut self,
        span: Span,
        callee: &Function,
        values: Vec<Local>,
        cx: &Context,
    ) -> Vec<Local> {
        let units = self.units_of_function(callee);
        if units.is_empty() || !self.builders.is_empty() {
            return values;
        }
        let mut claimed = Vec::with_capacity(values.len());
        for (input, value) in callee.inputs().zip(values) {
            match units.iter().find(|d| d.name == input.name.name) {
                Some(declared) => {
                    self.claim(span, "input", callee.name(), declared, &value, cx);
                    claimed.push(self.adopt(declared, value));
                }
                None => claimed.push(value),
            }
        }
        claimed
    }

    /// A value given to a declaration inside a function has its unit.
    pub(crate) fn claim_assigned(&mut self, span: Span, name: &Name, value: Local, cx: &Context) -> Local {
        let Some(&(function, _)) = cx.called.last() else { return value };
        if cx.depth == 0 || !self.builders.is_empty() {
            return value;
        }
        let Some(units) = self.function_units.get(&function).cloned() else { return value };
        let Some(declared) = units.iter().find(|d| d.name == *name) else { return value };
        let what = if declared.direction == Some(Direction::Output) { "output" } else { "variable" };
        let of = self.scopes.instances[function].name.clone();
        let of = of.rsplit('.').next().unwrap_or(&of).to_string();
        self.claim(span, what, &of, declared, &value, cx);
        self.adopt(declared, value)
    }

    /// A field of a record that is being constructed has the unit of its declaration.
    pub(crate) fn claim_field(
        &mut self,
        span: Span,
        (scope, declaration): (Scope, &Component),
        record: &str,
        value: Local,
        cx: &Context,
    ) -> Local {
        if !self.builders.is_empty() {
            return value;
        }
        let Some(unit) = self.scopes.declared_unit(scope, declaration) else { return value };
        let (name, span_of) = (declaration.name.name.clone(), declaration.name.span);
        let declared = Declared { name, direction: None, unit, span: span_of };
        self.claim(span, "field", record, &declared, &value, cx);
        self.adopt(&declared, value)
    }

    /// The results of a compiled function have the units that it declares.
    pub(crate) fn note_results(&mut self, callee: &Function, body: BodyId, outputs: &[(Name, u32)]) {
        if self.model.result_units.iter().any(|(known, ..)| *known == body) {
            return;
        }
        let units = self.units_of_function(callee);
        let mut k = 0;
        for (name, count) in outputs {
            let declared = units.iter().find(|d| d.name == *name && d.direction == Some(Direction::Output));
            for position in k..k + count {
                if let Some(declared) = declared {
                    self.model.result_units.push((body, position, declared.unit.clone()));
                }
            }
            k += count;
        }
    }

    fn claim(&mut self, span: Span, what: &str, of: &str, declared: &Declared, value: &Local, cx: &Context) {
        let nodes: Vec<&Typed> = match value {
            Local::Node(typed) => vec![typed],
            Local::Array(items, _) => items.iter().collect(),
            _ => return,
        };
        let given = what == "input" || what == "field";
        let what: Arc<str> = format!("the {what} `{}` of `{of}`", declared.name).into();
        let origin = Origin { path: self.path(cx.scope.inst), span };
        for typed in nodes {
            let literal = self.model.templates.arena.as_constant(typed.node).is_some();
            if literal || !matches!(typed.scalar, ScalarType::Real) {
                continue;
            }
            let right = self.quantity(1.0, &declared.unit, declared.name.clone(), declared.span);
            let Some(equations) =
                self.equations_over(Section::Continuous, typed.node, right.node, &cx.loop_counts(), &origin)
            else {
                continue;
            };
            let claim = UnitClaim {
                equations,
                what: what.clone(),
                call: cx.called_from.unwrap_or(span),
                given,
                declared: declared.span,
                unit: declared.unit.clone(),
            };
            let claims = self.tables().claims;
            if !claims.iter().rev().take(8).any(|known| *known == claim) {
                claims.push(claim);
            }
        }
    }
}
