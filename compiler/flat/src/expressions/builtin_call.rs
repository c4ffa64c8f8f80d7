//! Calls of operators with special meaning and of functions of the language.

use hyd_instance::{Builtin, ScalarType, SizeFault, SizesOf};
use hyd_source::{Code, Span};
use hyd_symbolic::{Function, Node};
use hyd_typed::{Expr, Kind, Type};

use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;

/// A call of a function or operator of the language.
pub(crate) struct BuiltinCall<'a, 't, 's> {
    pub flat: &'a mut Flattener<'t, 's>,
    pub builtin: Builtin,
    pub span: Span,
    pub list: &'a [Expr],
    pub cx: &'a mut Context,
}

impl BuiltinCall<'_, '_, '_> {
    pub(crate) fn expect_arguments(&mut self, name: &str, count: usize) -> Result<(), Fail> {
        let (span, list) = (self.span, self.list);
        if list.len() == count {
            return Ok(());
        }
        let message =
            format!("`{name}` takes {count} argument{}, not {}", if count == 1 { "" } else { "s" }, list.len());
        Err(self.flat.error(Code::BadArguments, span, message))
    }

    /// The element of the value at `index`.
    pub(crate) fn element(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list, builtin) = (self.span, self.list, self.builtin);
        let name = builtin.name();
        // What depends on more than the inputs (Modelica 3.6, section 12.2).
        if self.cx.depth > 0 && builtin.reads_run() {
            let message = format!("`{name}` is not allowed inside a function");
            return Err(self.flat.error(Code::Misplaced, span, message));
        }
        match builtin {
            Builtin::Der => self.lower_der(index),
            Builtin::Pre => self.lower_pre(index),
            Builtin::Edge | Builtin::Change => self.lower_edge(index),
            Builtin::Initial => Ok(Typed::boolean(self.flat.model.templates.arena.intern(Node::Initial))),
            Builtin::Terminal => Ok(self.flat.literal(0.0, ScalarType::Boolean)),
            Builtin::Text | Builtin::InstanceName => {
                Err(self.flat.error(Code::TypeMismatch, span, "a String is not a value of an equation"))
            }
            Builtin::NoEvent => {
                self.expect_arguments(name, 1)?;
                self.without_events(0, index)
            }
            Builtin::Smooth => {
                self.expect_arguments(name, 2)?;
                self.without_events(1, index)
            }
            Builtin::Homotopy => {
                self.expect_arguments(name, 2)?;
                let (actual, simplified) =
                    (self.flat.lower(&list[0], self.cx, index)?, self.flat.lower(&list[1], self.cx, index)?);
                Ok(self.flat.homotopy(actual, simplified))
            }
            Builtin::SemiLinear => self.lower_semi_linear(index),
            Builtin::InStream => self.lower_in_stream(index),
            Builtin::ActualStream => self.lower_actual_stream(index),
            Builtin::Sample if hyd_typed::is_clocked_sample(list) => self.lower_clocked(index),
            _ if builtin.is_of_clocks() => self.lower_clocked(index),
            Builtin::Sample => {
                let [start, interval] = list else {
                    let message = "`sample` takes the first instant and the interval";
                    return Err(self.flat.error(Code::BadArguments, span, message));
                };
                let (first, step) = (self.flat.lower(start, self.cx, &[])?, self.flat.lower(interval, self.cx, &[])?);
                self.flat.sample(span, (start.span, first), (interval.span, step), self.cx)
            }
            Builtin::Delay => {
                let mut parts = Vec::with_capacity(list.len());
                for part in list {
                    let scalar = self.flat.shape(part, self.cx)?.is_empty();
                    parts.push((part.span, self.flat.lower(part, self.cx, if scalar { &[] } else { index })?));
                }
                self.flat.delay(span, &parts, self.cx)
            }
            Builtin::Size
            | Builtin::Ndims
            | Builtin::Zeros
            | Builtin::Ones
            | Builtin::Fill
            | Builtin::Cardinality
            | Builtin::IsRoot
            | Builtin::Rooted
            | Builtin::Linspace => self.lower_constructor(index),
            Builtin::Sum | Builtin::Product => {
                self.expect_arguments(name, 1)?;
                self.flat.lower_fold(builtin, &list[0], self.cx)
            }
            Builtin::Min | Builtin::Max if list.len() == 1 => self.flat.lower_fold(builtin, &list[0], self.cx),
            Builtin::Floored => {
                self.expect_arguments(name, 1)?;
                let value = self.flat.lower(&list[0], self.cx, index)?;
                self.flat.lower_integer(span, &value, self.cx)
            }
            Builtin::Ordinal => {
                self.expect_arguments(name, 1)?;
                let value = self.flat.lower(&list[0], self.cx, index)?;
                match value.scalar {
                    ScalarType::Enumeration(_) => Ok(Typed { scalar: ScalarType::Integer, ..value }),
                    other => {
                        let message = format!("`Integer` takes a literal of an enumeration, not {}", other.name());
                        Err(self.flat.error(Code::TypeMismatch, list[0].span, message))
                    }
                }
            }
            Builtin::Min => self.lower_elementary(Function::Min, index),
            Builtin::Max => self.lower_elementary(Function::Max, index),
            Builtin::Elementary(function) => self.lower_elementary(function, index),
            _ => self.lower_array_function(index),
        }
    }

    /// Functions whose value is known from their arguments at translation, or whose elements are their argument.
    fn lower_constructor(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list, builtin) = (self.span, self.list, self.builtin);
        match (builtin, list) {
            (Builtin::Zeros, _) => return Ok(self.flat.literal(0.0, ScalarType::Integer)),
            (Builtin::Ones, _) => return Ok(self.flat.literal(1.0, ScalarType::Integer)),
            (Builtin::Fill, [value, sizes @ ..]) => {
                return self.flat.lower(value, self.cx, index.get(sizes.len()..).unwrap_or(&[]));
            }
            (Builtin::Linspace, [a, b, n]) => {
                let (a, b) = (self.flat.lower(a, self.cx, &[])?, self.flat.lower(b, self.cx, &[])?);
                let count = self.flat.affine(n, self.cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
                let Some(k) = index.first() else {
                    return Err(self.flat.no_scalar(span));
                };
                let k = match k.as_constant() {
                    Some(k) => self.flat.model.templates.arena.constant(k as f64),
                    None => {
                        let slot = self.flat.slots.slot(crate::state::index::SlotKey::Number(k.clone()));
                        self.flat.model.templates.arena.slot(slot)
                    }
                };
                let arena = &mut self.flat.model.templates.arena;
                let steps = arena.constant((count - 1).max(1) as f64);
                let distance = arena.sub(b.node, a.node);
                let step = arena.div(distance, steps);
                let way = arena.mul(step, k);
                return Ok(Typed::real(arena.add(a.node, way)));
            }
            (Builtin::Size, [array, ..]) => {
                let shape = self.flat.shape(array, self.cx)?;
                let k = match list.get(1) {
                    Some(k) => self.flat.affine(k, self.cx)?.as_constant().ok_or(Fail::NeedsExpansion)? - 1,
                    None => match index.first() {
                        Some(k) => k.as_constant().ok_or(Fail::NeedsExpansion)?,
                        None => {
                            return Err(self.flat.no_scalar(span));
                        }
                    },
                };
                let Some(&size) = usize::try_from(k).ok().and_then(|k| shape.get(k)) else {
                    return Err(self.flat.error(Code::ArrayShape, span, format!("there is no dimension {}", k + 1)));
                };
                return Ok(self.flat.literal(size as f64, ScalarType::Integer));
            }
            (Builtin::Ndims, [array]) => {
                let dimensions = self.flat.shape(array, self.cx)?.len();
                return Ok(self.flat.literal(dimensions as f64, ScalarType::Integer));
            }
            _ => {}
        }
        let (env, _) = self.cx.env();
        let whole = Expr { kind: Kind::Builtin(builtin, list.to_vec()), ty: Type::NONE, span };
        let value = self.flat.scopes.evaluate(&whole.evaluable(), self.cx.scope, &env)?;
        self.flat.element_of_value(span, &value, index)
    }

    fn lower_elementary(&mut self, function: Function, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list) = (self.span, self.list);
        self.expect_arguments(function.name(), function.arity())?;
        let mut values = Vec::with_capacity(2);
        for argument in list {
            let shape = self.flat.shape(argument, self.cx)?;
            let value = self.flat.lower(argument, self.cx, if shape.is_empty() { &[] } else { index })?;
            self.flat.want_number(argument.span, &format!("`{}`", function.name()), &value)?;
            values.push(value);
        }
        let whole = values.iter().all(|v| matches!(v.scalar, ScalarType::Integer));
        let keeps = matches!(
            function,
            Function::Abs | Function::Min | Function::Max | Function::Div | Function::Mod | Function::Rem
        );
        let integer = function == Function::Sign || keeps && whole;
        if let Some(node) = self.flat.lower_jump(span, function, &values, self.cx)? {
            return Ok(Typed { node, scalar: if integer { ScalarType::Integer } else { ScalarType::Real } });
        }
        let arena = &mut self.flat.model.templates.arena;
        let node = match values.as_slice() {
            [a] => arena.call1(function, a.node),
            [a, b] => arena.call2(function, a.node, b.node),
            _ => return Err(Fail::Reported),
        };
        Ok(Typed { node, scalar: if integer { ScalarType::Integer } else { ScalarType::Real } })
    }
}

impl SizesOf for BuiltinCall<'_, '_, '_> {
    type Fail = Fail;

    fn count(&self) -> usize {
        self.list.len()
    }

    fn sizes(&mut self, k: usize) -> Result<Vec<usize>, Fail> {
        self.flat.shape(&self.list[k], self.cx)
    }

    fn number(&mut self, k: usize) -> Result<usize, Fail> {
        let expr = &self.list[k];
        let number = self.flat.affine(expr, self.cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
        let negative = |_| self.flat.error(Code::ArrayShape, expr.span, format!("the size {number} is negative"));
        usize::try_from(number).map_err(negative)
    }

    fn fault(&mut self, fault: SizeFault) -> Fail {
        let (code, message) = fault.message(self.builtin);
        let place = fault.place(|k| self.list[k].span, self.span);
        self.flat.error(code, place, message)
    }
}
