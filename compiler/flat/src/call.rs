//! Calls: operators with special meaning, functions of the language, and the user's own functions (see `function`).

use hyd_instance::{Builtin, ScalarType, SizeFault, SizesOf};
use hyd_source::{Code, Span};
use hyd_symbolic::{Function, Node};
use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind};

use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

/// `homotopy(actual = a, simplified = s)` by position.
fn homotopy_arguments(builtin: Builtin, arguments: &Arguments) -> Option<Vec<Expr>> {
    let Arguments::List { positional, named } = arguments else { return None };
    if builtin != Builtin::Homotopy || named.is_empty() {
        return None;
    }
    let given = |k: usize, name: &str| {
        positional.get(k).or_else(|| named.iter().find(|(n, _)| n.name.as_ref() == name).map(|(_, e)| e)).cloned()
    };
    Some(vec![given(0, "actual")?, given(1, "simplified")?])
}

impl Flattener<'_, '_> {
    /// The function or operator of the language that is called; `None` for another name and where a declaration hides it.
    pub(crate) fn predefined(&mut self, function: &ComponentRef, cx: &Context) -> Option<Builtin> {
        self.tree.predefined(cx.scope, function)
    }

    pub(crate) fn lower_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let list: &[Expr] = match arguments {
            Arguments::List { positional, .. } => positional,
            Arguments::Reduction(body, iterators) => {
                return self.lower_reduction(span, function, body, iterators, cx);
            }
        };
        let Some(builtin) = self.predefined(function, cx) else {
            return self.lower_user_call(span, function, arguments, cx, index);
        };
        let ordered = homotopy_arguments(builtin, arguments);
        self.lower_predefined(span, builtin, ordered.as_deref().unwrap_or(list), cx, index)
    }

    /// Operators that this profile leaves out are refused by name.
    fn check_profile(&mut self, span: Span, builtin: Builtin) -> Result<(), Fail> {
        match builtin {
            Builtin::Reinit => {
                let message = "`reinit` is an equation of its own inside `when`, not a value";
                Err(self.error(Code::Misplaced, span, message))
            }
            Builtin::Outside(sentence) => Err(self.error(Code::OutsideProfile, span, sentence)),
            _ => Ok(()),
        }
    }

    pub(crate) fn expect_arguments(&mut self, span: Span, name: &str, list: &[Expr], count: usize) -> Result<(), Fail> {
        if list.len() == count {
            return Ok(());
        }
        let message =
            format!("`{name}` takes {count} argument{}, not {}", if count == 1 { "" } else { "s" }, list.len());
        Err(self.error(Code::BadArguments, span, message))
    }

    fn lower_predefined(
        &mut self,
        span: Span,
        builtin: Builtin,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        self.check_profile(span, builtin)?;
        let name = builtin.name();
        // What depends on more than the inputs (Modelica 3.6, section 12.2).
        if cx.depth > 0 && builtin.reads_run() {
            let message = format!("`{name}` is not allowed inside a function");
            return Err(self.error(Code::Misplaced, span, message));
        }
        match builtin {
            Builtin::Der => self.lower_der(span, list, cx, index),
            Builtin::Pre => self.lower_pre(span, list, cx, index),
            Builtin::Edge | Builtin::Change => self.lower_edge(span, builtin, list, cx, index),
            Builtin::Initial => Ok(Typed::boolean(self.model.templates.arena.intern(Node::Initial))),
            Builtin::Terminal => Ok(self.literal(0.0, ScalarType::Boolean)),
            Builtin::Text => Err(self.error(Code::TypeMismatch, span, "a String is not a value of an equation")),
            Builtin::NoEvent => {
                self.expect_arguments(span, name, list, 1)?;
                self.without_events(&list[0], cx, index)
            }
            Builtin::Smooth => {
                self.expect_arguments(span, name, list, 2)?;
                self.without_events(&list[1], cx, index)
            }
            Builtin::Homotopy => {
                self.expect_arguments(span, name, list, 2)?;
                self.lower_homotopy(&list[0], &list[1], cx, index)
            }
            Builtin::SemiLinear => self.lower_semi_linear(span, list, cx, index),
            Builtin::Sample => self.lower_sample(span, list, cx),
            Builtin::Delay => self.lower_delay(span, list, cx, index),
            Builtin::Size
            | Builtin::Ndims
            | Builtin::Zeros
            | Builtin::Ones
            | Builtin::Fill
            | Builtin::Identity
            | Builtin::Linspace => self.lower_constructor(span, builtin, list, cx, index),
            Builtin::Sum | Builtin::Product => {
                self.expect_arguments(span, name, list, 1)?;
                self.lower_fold(builtin, &list[0], cx)
            }
            Builtin::Min | Builtin::Max if list.len() == 1 => self.lower_fold(builtin, &list[0], cx),
            Builtin::Floored => {
                self.expect_arguments(span, name, list, 1)?;
                let value = self.lower(&list[0], cx, index)?;
                self.lower_integer(span, &value, cx)
            }
            Builtin::Ordinal => {
                self.expect_arguments(span, name, list, 1)?;
                let value = self.lower(&list[0], cx, index)?;
                match value.scalar {
                    ScalarType::Enumeration(_) => Ok(Typed { scalar: ScalarType::Integer, ..value }),
                    other => {
                        let message = format!("`Integer` takes a literal of an enumeration, not {}", other.name());
                        Err(self.error(Code::TypeMismatch, list[0].span, message))
                    }
                }
            }
            Builtin::Min => self.lower_elementary(span, Function::Min, list, cx, index),
            Builtin::Max => self.lower_elementary(span, Function::Max, list, cx, index),
            Builtin::Elementary(function) => self.lower_elementary(span, function, list, cx, index),
            _ => self.lower_array_function(span, builtin, list, cx, index),
        }
    }

    /// Functions whose value is known from their arguments at translation, or whose elements are their argument.
    fn lower_constructor(
        &mut self,
        span: Span,
        builtin: Builtin,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        match (builtin, list) {
            (Builtin::Zeros, _) => return Ok(self.literal(0.0, ScalarType::Integer)),
            (Builtin::Ones, _) => return Ok(self.literal(1.0, ScalarType::Integer)),
            (Builtin::Identity, [_]) => {
                let [i, j] = index else {
                    return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
                };
                let (i, j) = (i.as_constant(), j.as_constant());
                let same = i.zip(j).ok_or(Fail::NeedsExpansion)?;
                return Ok(self.literal(f64::from(u8::from(same.0 == same.1)), ScalarType::Integer));
            }
            (Builtin::Fill, [value, sizes @ ..]) => {
                return self.lower(value, cx, index.get(sizes.len()..).unwrap_or(&[]));
            }
            (Builtin::Linspace, [a, b, n]) => {
                let (a, b) = (self.lower(a, cx, &[])?, self.lower(b, cx, &[])?);
                let count = self.affine(n, cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
                let Some(k) = index.first() else {
                    return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
                };
                let k = match k.as_constant() {
                    Some(k) => self.model.templates.arena.constant(k as f64),
                    None => {
                        let slot = self.slots.slot(crate::index::SlotKey::Number(k.clone()));
                        self.model.templates.arena.slot(slot)
                    }
                };
                let arena = &mut self.model.templates.arena;
                let steps = arena.constant((count - 1).max(1) as f64);
                let distance = arena.sub(b.node, a.node);
                let step = arena.div(distance, steps);
                let way = arena.mul(step, k);
                return Ok(Typed::real(arena.add(a.node, way)));
            }
            (Builtin::Size, [array, ..]) => {
                let shape = self.shape(array, cx)?;
                let k = match list.get(1) {
                    Some(k) => self.affine(k, cx)?.as_constant().ok_or(Fail::NeedsExpansion)? - 1,
                    None => match index.first() {
                        Some(k) => k.as_constant().ok_or(Fail::NeedsExpansion)?,
                        None => {
                            return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
                        }
                    },
                };
                let Some(&size) = usize::try_from(k).ok().and_then(|k| shape.get(k)) else {
                    return Err(self.error(Code::ArrayShape, span, format!("there is no dimension {}", k + 1)));
                };
                return Ok(self.literal(size as f64, ScalarType::Integer));
            }
            (Builtin::Ndims, [array]) => {
                let dimensions = self.shape(array, cx)?.len();
                return Ok(self.literal(dimensions as f64, ScalarType::Integer));
            }
            _ => {}
        }
        let (env, _) = cx.env();
        let whole = call_expr(span, builtin.name(), list);
        let value = self.tree.evaluate(&whole, cx.scope, &env)?;
        self.element_of_value(span, &value, index)
    }

    fn lower_elementary(
        &mut self,
        span: Span,
        function: Function,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        self.expect_arguments(span, function.name(), list, function.arity())?;
        let mut values = Vec::with_capacity(2);
        for argument in list {
            let shape = self.shape(argument, cx)?;
            let value = self.lower(argument, cx, if shape.is_empty() { &[] } else { index })?;
            self.want_number(argument.span, &format!("`{}`", function.name()), &value)?;
            values.push(value);
        }
        let whole = values.iter().all(|v| matches!(v.scalar, ScalarType::Integer));
        let keeps = matches!(
            function,
            Function::Abs | Function::Min | Function::Max | Function::Div | Function::Mod | Function::Rem
        );
        let integer = function == Function::Sign || keeps && whole;
        if let Some(node) = self.lower_jump(span, function, &values, cx)? {
            return Ok(Typed { node, scalar: if integer { ScalarType::Integer } else { ScalarType::Real } });
        }
        let arena = &mut self.model.templates.arena;
        let node = match values.as_slice() {
            [a] => arena.call1(function, a.node),
            [a, b] => arena.call2(function, a.node, b.node),
            _ => return Err(Fail::Reported),
        };
        Ok(Typed { node, scalar: if integer { ScalarType::Integer } else { ScalarType::Real } })
    }

    /// Sizes of a call's value.
    pub(crate) fn shape_of_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        let Arguments::List { positional: list, .. } = arguments else { return Ok(Vec::new()) };
        let Some(function) = self.predefined(function, cx) else {
            return self.shape_of_user_call(span, function, arguments, cx);
        };
        self.check_profile(span, function)?;
        function.sizes(&mut List { flat: self, function, span, list, cx })
    }
}

/// The arguments of a function of the language.
pub(crate) struct List<'a, 't, 's> {
    pub flat: &'a mut Flattener<'t, 's>,
    pub function: Builtin,
    pub span: Span,
    pub list: &'a [Expr],
    pub cx: &'a mut Context,
}

impl SizesOf for List<'_, '_, '_> {
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
        let (code, message) = fault.message(self.function);
        self.flat.error(code, fault.place(self.list, self.span), message)
    }
}

fn call_expr(span: Span, name: &str, list: &[Expr]) -> Expr {
    let ident = hyd_syntax::tree::Ident { name: name.into(), span };
    let part = hyd_syntax::tree::RefPart { name: ident, subscripts: Vec::new() };
    let function = ComponentRef { global: false, parts: vec![part], span };
    let arguments = Arguments::List { positional: list.to_vec(), named: Vec::new() };
    Expr { kind: ExprKind::Call(function, arguments), span }
}
