//! Calls of external functions (Modelica 3.6, section 12.9).
//!
//! What is known of them stands in `hyd_instance::external`.  Tables are functions of the run, made once per table and column; all others
//! are computed at translation and need arguments that are known then.

use hyd_instance::external::{Given, ObjectKind, TableFunction, draws_hidden, is_effect_only, sets_hidden_state};
use hyd_instance::{InstId, ScalarType, Value};
use hyd_source::{Code, Span};
use hyd_symbolic::{BodyId, Node, NodeId, SlotId, Step};
use hyd_syntax::tree::{Direction, Name};
use hyd_typed::{Expr, External, Function, Kind};

use crate::functions::table_body;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, KnownTable, Outputs};
use crate::state::index::SlotKey;
use crate::state::node::Typed;

/// So many calls of functions of one text inside each other have no end.
const SAME_TEXT: usize = 3;

impl Flattener<'_, '_> {
    /// A call of an external function with the values of its inputs.
    pub(crate) fn call_external(
        &mut self,
        span: Span,
        callee: &Function,
        external: &External,
        values: Vec<Local>,
        cx: &Context,
    ) -> Result<Outputs, Fail> {
        // Only what its declarations say can call it again, and would do so for ever; where it inherits from a class around it, by another
        // function of its text each time.
        let text = self.text_of_function(callee.inst);
        let again = cx.called.iter().filter(|(own, _)| self.text_of_function(*own) == text).count();
        if again >= SAME_TEXT || cx.called.iter().any(|(own, _)| *own == callee.inst) {
            let message =
                format!("the declarations of `{}`, which is an external function, call itself", callee.name());
            return Err(self.error(Code::Limit, span, message));
        }
        let mut inner = cx.inside(callee);
        inner.called_from = Some(cx.called_from.unwrap_or(span));
        let values = self.claim_inputs(span, callee, values, cx);
        for (input, value) in callee.inputs().zip(values) {
            inner.names.push((input.name.name.clone(), value));
        }
        self.declare_values(callee, &mut inner);
        let name = external.name();
        if is_effect_only(name) {
            self.scopes.no_effect(span, name);
            let went_well = self.literal(1.0, ScalarType::Boolean);
            let outputs = callee.outputs().map(|output| (output.name.name.clone(), Local::Node(went_well.clone())));
            return Ok(outputs.collect());
        }
        if sets_hidden_state(name) {
            let state = match external.arguments.first().map(|argument| &argument.kind) {
                Some(Kind::Local(local)) => inner.local(local.name()).cloned(),
                _ => None,
            };
            self.set_hidden_state(span, state.as_ref(), cx)?;
            return Ok(Vec::new());
        }
        if draws_hidden(name) {
            return self.draw(span, callee, cx);
        }
        if let Some(function) = TableFunction::of(name) {
            let node = self.call_table(span, external, function, &mut inner, cx)?;
            let output = callee.outputs().next().map_or_else(|| Name::from(""), |output| output.name.name.clone());
            return Ok(vec![(output, Local::Node(Typed::real(node)))]);
        }
        self.call_at_translation(span, callee, external, &mut inner)
    }

    /// Where the text of a function begins.
    fn text_of_function(&self, inst: InstId) -> Option<Span> {
        let class = self.scopes.instances[inst].class?;
        Some(self.scopes.table.class(class).def.name.span)
    }

    /// Outputs and variables with what their declarations give, whatever their order is; those that get nothing here are left out.
    fn declare_values(&mut self, callee: &Function, inner: &mut Context) {
        let mut open: Vec<_> = callee.others().collect();
        let mut count = usize::MAX;
        while open.len() < count {
            count = open.len();
            open.retain(|declaration| {
                inner.scope.frame = declaration.frame;
                let (declared, draft) = self.attempt(|flat| flat.declare_local(declaration, callee, inner));
                if declared.is_ok() {
                    self.keep(draft);
                }
                declared.is_err()
            });
        }
        inner.scope.frame = 0;
    }

    fn call_at_translation(
        &mut self,
        span: Span,
        callee: &Function,
        external: &External,
        inner: &mut Context,
    ) -> Result<Outputs, Fail> {
        let outside = |flat: &mut Self| {
            let message = format!("`{}` is an external function, which is outside the language profile", callee.name());
            Err(flat.error(Code::OutsideProfile, external.text.span, message))
        };
        let is_output = |expr: &Expr| match &expr.kind {
            Kind::Local(local) => {
                callee.variables.iter().any(|v| v.name.name == *local.name() && v.direction == Some(Direction::Output))
            }
            _ => false,
        };
        let mut arguments = Vec::with_capacity(external.arguments.len());
        for argument in &external.arguments {
            if is_output(argument) {
                // What the function sets has the value of its declaration, if any.
                let declared = match &argument.kind {
                    Kind::Local(local) => inner.local(local.name()).cloned(),
                    _ => None,
                };
                let known = declared.map(|local| self.known_local(&local)).transpose()?.flatten();
                arguments.push(known.unwrap_or(Value::Integer(0)));
                continue;
            }
            let local = self.local_value(argument, inner)?;
            match self.known_local(&local)? {
                Some(value) => arguments.push(value),
                None => return outside(self),
            }
        }
        let Some(given) = self.scopes.external_value(span, external.name(), &arguments) else { return outside(self) };
        let Given { value, set } = given?;
        let mut found: Vec<(Name, Value)> = Vec::new();
        let mut note = |target: Option<&Expr>, value: Value| {
            if let Some(Kind::Local(local)) = target.map(|target| &target.kind) {
                found.push((local.name().clone(), value));
            }
        };
        if let Some(value) = value {
            note(external.output.as_ref(), value);
        }
        for (position, value) in set {
            note(external.arguments.get(position), value);
        }
        let mut outputs = Vec::new();
        for output in callee.outputs() {
            let Some((name, value)) = found.iter().find(|(name, _)| *name == output.name.name) else {
                return outside(self);
            };
            outputs.push((name.clone(), self.local_of_value(span, value, output.ty.base.clone())?));
        }
        Ok(outputs)
    }

    /// A value of the translation as a local one; the number of a literal where the output is an enumeration.
    pub(crate) fn local_of_value(&mut self, span: Span, value: &Value, base: hyd_typed::Base) -> Result<Local, Fail> {
        let value = match (value, base) {
            (Value::Integer(k), hyd_typed::Base::Scalar(ScalarType::Enumeration(of))) => {
                Value::Enumeration(of, u32::try_from(*k).unwrap_or(1))
            }
            (value, _) => value.clone(),
        };
        Ok(match &value {
            Value::Text(_) | Value::Object(_) => Local::Value(value),
            Value::Integer(_) => Local::Node(self.constant_value(span, &value)?),
            Value::Array(_) => {
                let mut items = Vec::new();
                for item in value.flatten() {
                    items.push(self.constant_value(span, item)?);
                }
                Local::array(items, value.shape())
            }
            single => Local::Node(self.constant_value(span, single)?),
        })
    }

    /// The value of a local that is known at translation.
    ///
    /// # Errors
    /// When it is known once the loops around are run through.
    pub(crate) fn known_local(&mut self, local: &Local) -> Result<Option<Value>, Fail> {
        Ok(match local {
            Local::Value(value) => Some(value.clone()),
            Local::Index(affine) => match affine.as_constant() {
                Some(k) => Some(Value::Integer(k)),
                None => return Err(Fail::NeedsExpansion),
            },
            Local::Node(typed) => self.known_node(typed)?,
            Local::Array(items, shape) => {
                let mut values = Vec::with_capacity(items.len());
                for item in items.iter() {
                    let Some(value) = self.known_node(item)? else { return Ok(None) };
                    values.push(value);
                }
                Some(Value::nested(values, shape))
            }
            Local::Record(_) | Local::Records(..) | Local::Function(_) => None,
        })
    }

    fn known_node(&self, typed: &Typed) -> Result<Option<Value>, Fail> {
        let arena = &self.model.templates.arena;
        let Some(number) = arena.as_constant(typed.node) else {
            // Inside a body slots are registers.
            let counted = match arena.node(typed.node) {
                Node::Slot(slot) if self.builders.is_empty() => {
                    matches!(self.slots.keys.get(slot.0 as usize), Some(SlotKey::Number(_)))
                }
                _ => false,
            };
            return if counted { Err(Fail::NeedsExpansion) } else { Ok(None) };
        };
        Ok(match &typed.scalar {
            ScalarType::Real => Some(Value::Real(number)),
            ScalarType::Integer => Some(Value::Integer(number as i64)),
            ScalarType::Boolean => Some(Value::Boolean(number != 0.0)),
            ScalarType::Enumeration(of) => Some(Value::Enumeration(of.clone(), number as u32)),
            ScalarType::Text | ScalarType::Object | ScalarType::Clock => None,
        })
    }

    fn call_table(
        &mut self,
        span: Span,
        external: &External,
        function: TableFunction,
        inner: &mut Context,
        cx: &Context,
    ) -> Result<NodeId, Fail> {
        let wrong = "this function takes a table and its arguments";
        let Some((table, mut rest)) = external.arguments.split_first() else {
            return Err(self.error(Code::BadArguments, external.text.span, wrong));
        };
        let Local::Value(Value::Object(table)) = self.local_value(table, inner)? else {
            return Err(self.error(Code::NotStructural, span, "a table must be known before the run"));
        };
        let mut column = 0;
        if matches!(function, TableFunction::Value1d(_) | TableFunction::ValueOfTime(_))
            && let Some((first, others)) = rest.split_first()
        {
            rest = others;
            let local = self.local_value(first, inner)?;
            let known = self.known_local(&local)?.and_then(|value| value.as_integer());
            let Some(k) = known.and_then(|k| usize::try_from(k).ok()) else {
                return Err(self.error(
                    Code::NotStructural,
                    span,
                    "the column of a table must be known before the run",
                ));
            };
            column = k;
        }
        let mut given = Vec::with_capacity(rest.len());
        for argument in rest {
            given.push(self.lower(argument, inner, &[])?.node);
        }
        let value = |flat: &mut Self, order: [u32; 2], arguments: &[NodeId]| {
            let body = flat.table_body(span, (table.clone(), function, column, order))?;
            Ok::<NodeId, Fail>(flat.apply_body(body, arguments, cx))
        };
        // Derivatives by the clock, by the chain rule (12.7.1).
        match (function, given.as_slice()) {
            (TableFunction::Value1d(0), &[u]) => value(self, [0, 0], &[u]),
            (TableFunction::Value1d(1), &[u, du]) => {
                let slope = value(self, [1, 0], &[u])?;
                Ok(self.model.templates.arena.mul(slope, du))
            }
            (TableFunction::Value1d(2), &[u, du, ddu]) => {
                let (slope, bend) = (value(self, [1, 0], &[u])?, value(self, [2, 0], &[u])?);
                Ok(self.second_rate(slope, bend, du, ddu))
            }
            (TableFunction::ValueOfTime(0), &[t, next, _]) => value(self, [0, 0], &[t, next]),
            (TableFunction::ValueOfTime(1), &[t, next, _, dt]) => {
                let slope = value(self, [1, 0], &[t, next])?;
                Ok(self.model.templates.arena.mul(slope, dt))
            }
            (TableFunction::ValueOfTime(2), &[t, next, _, dt, ddt]) => {
                let (slope, bend) = (value(self, [1, 0], &[t, next])?, value(self, [2, 0], &[t, next])?);
                Ok(self.second_rate(slope, bend, dt, ddt))
            }
            (TableFunction::NextTimeEvent, &[t]) => value(self, [0, 0], &[t]),
            (TableFunction::Value2d(0), &[u, v]) => value(self, [0, 0], &[u, v]),
            (TableFunction::Value2d(1), &[u, v, du, dv]) => {
                let (a, b) = (value(self, [1, 0], &[u, v])?, value(self, [0, 1], &[u, v])?);
                let arena = &mut self.model.templates.arena;
                let (x, y) = (arena.mul(a, du), arena.mul(b, dv));
                Ok(arena.add(x, y))
            }
            (TableFunction::Value2d(2), &[u, v, du, dv, ddu, ddv]) => {
                let (a, b) = (value(self, [1, 0], &[u, v])?, value(self, [0, 1], &[u, v])?);
                let mixed = value(self, [1, 1], &[u, v])?;
                let arena = &mut self.model.templates.arena;
                let (x, y) = (arena.mul(a, ddu), arena.mul(b, ddv));
                let two = arena.constant(2.0);
                let both = arena.mul(du, dv);
                let both = arena.mul(both, two);
                let (sum, last) = (arena.add(x, y), arena.mul(mixed, both));
                Ok(arena.add(sum, last))
            }
            _ => Err(self.error(Code::BadArguments, external.text.span, wrong)),
        }
    }

    /// `f'' du^2 + f' ddu`
    fn second_rate(&mut self, slope: NodeId, bend: NodeId, du: NodeId, ddu: NodeId) -> NodeId {
        let arena = &mut self.model.templates.arena;
        let square = arena.mul(du, du);
        let (a, b) = (arena.mul(bend, square), arena.mul(slope, ddu));
        arena.add(a, b)
    }

    /// The body of a function of a table.
    fn table_body(&mut self, span: Span, asked: KnownTable) -> Result<BodyId, Fail> {
        if let Some((_, body)) = self.tables_known.iter().find(|(known, _)| *known == asked) {
            return Ok(*body);
        }
        let (table, function, column, order) = &asked;
        let arena = &mut self.model.templates.arena;
        let made = match (&table.kind, function) {
            (ObjectKind::Table1d(table), TableFunction::Value1d(_)) => {
                let pieces = table.pieces(*column);
                pieces.map(|pieces| table_body::of_pieces(arena, "table", &pieces.derivative(order[0])))
            }
            (ObjectKind::Table2d(table), TableFunction::Value2d(_)) => {
                Ok(table_body::of_patches(arena, "table", table, *order))
            }
            (ObjectKind::TimeTable(table), TableFunction::ValueOfTime(_)) => {
                table_body::of_time(arena, "table of time", table, *column, order[0])
            }
            (ObjectKind::TimeTable(table), TableFunction::NextTimeEvent) => {
                Ok(table_body::next_event(arena, "next event", table))
            }
            _ => Err("the table is of another kind".to_string()),
        };
        match made {
            Ok(body) => {
                self.tables_known.push((asked, body));
                Ok(body)
            }
            Err(sentence) => Err(self.error(Code::BadArguments, span, sentence)),
        }
    }

    /// The value of a body of one result, in an expression or as a step of the body around.
    fn apply_body(&mut self, body: BodyId, arguments: &[NodeId], cx: &Context) -> NodeId {
        if self.in_body(cx) {
            let register = self.registers(1).start;
            self.step(Step::Call { body, arguments: arguments.to_vec(), results: vec![register] });
            return self.model.templates.arena.slot(SlotId(register));
        }
        let arena = &mut self.model.templates.arena;
        let list = arena.argument_list(arguments);
        arena.apply(body, 0, list)
    }
}
