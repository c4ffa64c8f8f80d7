//! Calls: operators with special meaning, functions of the language, and the user's own functions (see `function`).

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_symbolic::{Function, Node};
use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind};

use crate::array::ARRAY_FUNCTIONS;
use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

/// Operators and functions of Modelica that this profile does not read yet or not at all.
const OUTSIDE: &[(&str, &str)] = &[
    ("spatialDistribution", "`spatialDistribution` is outside the language profile"),
    ("inStream", "stream connectors are outside the language profile"),
    ("actualStream", "stream connectors are outside the language profile"),
    ("cardinality", "`cardinality` is outside the language profile"),
    ("hold", "clocks are outside the language profile"),
    ("previous", "clocks are outside the language profile"),
    ("subSample", "clocks are outside the language profile"),
    ("superSample", "clocks are outside the language profile"),
    ("shiftSample", "clocks are outside the language profile"),
    ("Clock", "clocks are outside the language profile"),
];

/// True for functions and operators of the language itself.
pub(crate) fn is_predefined(name: &str) -> bool {
    const OPERATORS: &[&str] = &[
        "der",
        "pre",
        "edge",
        "change",
        "sample",
        "delay",
        "initial",
        "terminal",
        "noEvent",
        "smooth",
        "homotopy",
        "semiLinear",
        "size",
        "ndims",
        "zeros",
        "ones",
        "fill",
        "identity",
        "linspace",
        "sum",
        "product",
        "integer",
        "Integer",
        "String",
        "reinit",
    ];
    OPERATORS.contains(&name)
        || ARRAY_FUNCTIONS.contains(&name)
        || Function::from_name(name).is_some()
        || OUTSIDE.iter().any(|(n, _)| *n == name)
}

pub(crate) fn simple_name(function: &ComponentRef) -> Option<&str> {
    match function.parts.as_slice() {
        [only] if !function.global => Some(&only.name.name),
        _ => None,
    }
}

/// `homotopy(actual = a, simplified = s)` by position.
fn homotopy_arguments(name: &str, arguments: &Arguments) -> Option<Vec<Expr>> {
    let Arguments::List { positional, named } = arguments else { return None };
    if name != "homotopy" || named.is_empty() {
        return None;
    }
    let given = |k: usize, name: &str| {
        positional.get(k).or_else(|| named.iter().find(|(n, _)| n.name.as_ref() == name).map(|(_, e)| e)).cloned()
    };
    Some(vec![given(0, "actual")?, given(1, "simplified")?])
}

impl Flattener<'_, '_> {
    /// The function or operator of the language that is called; `None` for another name and where a declaration hides it.
    pub(crate) fn predefined<'r>(&mut self, function: &'r ComponentRef, cx: &Context) -> Option<&'r str> {
        let name = simple_name(function).filter(|name| is_predefined(name))?;
        self.tree.predefined(cx.scope, function).map(|_| name)
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
        if let Some(name) = self.predefined(function, cx) {
            let ordered = homotopy_arguments(name, arguments);
            let list = ordered.as_deref().unwrap_or(list);
            if let Some(result) = self.lower_operator(span, name, list, cx, index) {
                return result;
            }
            if let Some(builtin) = Function::from_name(name) {
                return self.lower_builtin(span, builtin, list, cx, index);
            }
        }
        self.lower_user_call(span, function, arguments, cx, index)
    }

    /// Operators that this profile leaves out are refused by name.
    fn check_profile(&mut self, span: Span, name: &str) -> Result<(), Fail> {
        if name == "reinit" {
            let message = "`reinit` is an equation of its own inside `when`, not a value";
            return Err(self.error(Code::Misplaced, span, message));
        }
        match OUTSIDE.iter().find(|(n, _)| *n == name) {
            Some((_, sentence)) => Err(self.error(Code::OutsideProfile, span, *sentence)),
            None => Ok(()),
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

    /// Operators with special meaning; `None` if `name` is none of them.
    fn lower_operator(
        &mut self,
        span: Span,
        name: &str,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Option<Result<Typed, Fail>> {
        if let Err(fail) = self.check_profile(span, name) {
            return Some(Err(fail));
        }
        // What depends on more than the inputs (Modelica 3.6, section 12.2).
        if cx.depth > 0 && matches!(name, "der" | "pre" | "edge" | "change" | "initial" | "terminal" | "sample") {
            let message = format!("`{name}` is not allowed inside a function");
            return Some(Err(self.error(Code::Misplaced, span, message)));
        }
        Some(match name {
            "der" => self.lower_der(span, list, cx, index),
            "pre" => self.lower_pre(span, list, cx, index),
            "edge" | "change" => self.lower_edge(span, name, list, cx, index),
            "initial" => Ok(Typed::boolean(self.model.templates.arena.intern(Node::Initial))),
            "terminal" => Ok(self.literal(0.0, ScalarType::Boolean)),
            "String" => Err(self.error(Code::TypeMismatch, span, "a String is not a value of an equation")),
            "noEvent" => {
                self.expect_arguments(span, name, list, 1).and_then(|()| self.without_events(&list[0], cx, index))
            }
            "smooth" => {
                self.expect_arguments(span, name, list, 2).and_then(|()| self.without_events(&list[1], cx, index))
            }
            "homotopy" => self
                .expect_arguments(span, name, list, 2)
                .and_then(|()| self.lower_homotopy(&list[0], &list[1], cx, index)),
            "semiLinear" => self.lower_semi_linear(span, list, cx, index),
            "sample" => self.lower_sample(span, list, cx),
            "delay" => self.lower_delay(span, list, cx, index),
            "size" | "ndims" | "zeros" | "ones" | "fill" | "identity" | "linspace" => {
                self.lower_constructor(span, name, list, cx, index)
            }
            "sum" | "product" => {
                self.expect_arguments(span, name, list, 1).and_then(|()| self.lower_fold(name, &list[0], cx))
            }
            "min" | "max" if list.len() == 1 => self.lower_fold(name, &list[0], cx),
            _ if ARRAY_FUNCTIONS.contains(&name) => self.lower_array_function(span, name, list, cx, index),
            "integer" => self.expect_arguments(span, name, list, 1).and_then(|()| {
                let value = self.lower(&list[0], cx, index)?;
                self.lower_integer(span, &value, cx)
            }),
            "Integer" => self.expect_arguments(span, name, list, 1).and_then(|()| {
                let value = self.lower(&list[0], cx, index)?;
                match value.scalar {
                    ScalarType::Enumeration(_) => Ok(Typed { scalar: ScalarType::Integer, ..value }),
                    other => {
                        let message = format!("`Integer` takes a literal of an enumeration, not {}", other.name());
                        Err(self.error(Code::TypeMismatch, list[0].span, message))
                    }
                }
            }),
            _ => return None,
        })
    }

    /// Functions whose value is known from their arguments at translation, or whose elements are their argument.
    fn lower_constructor(
        &mut self,
        span: Span,
        name: &str,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        match (name, list) {
            ("zeros", _) => return Ok(self.literal(0.0, ScalarType::Integer)),
            ("ones", _) => return Ok(self.literal(1.0, ScalarType::Integer)),
            ("identity", [_]) => {
                let [i, j] = index else {
                    return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
                };
                let (i, j) = (i.as_constant(), j.as_constant());
                let same = i.zip(j).ok_or(Fail::NeedsExpansion)?;
                return Ok(self.literal(f64::from(u8::from(same.0 == same.1)), ScalarType::Integer));
            }
            ("fill", [value, sizes @ ..]) => return self.lower(value, cx, index.get(sizes.len()..).unwrap_or(&[])),
            ("linspace", [a, b, n]) => {
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
            ("size", [array, ..]) => {
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
            ("ndims", [array]) => {
                let dimensions = self.shape(array, cx)?.len();
                return Ok(self.literal(dimensions as f64, ScalarType::Integer));
            }
            _ => {}
        }
        let (env, _) = cx.env();
        let whole = call_expr(span, name, list);
        let value = self.tree.evaluate(&whole, cx.scope, &env)?;
        self.element_of_value(span, &value, index)
    }

    fn lower_builtin(
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
        let Some(name) = self.predefined(function, cx) else {
            return self.shape_of_user_call(span, function, arguments, cx);
        };
        self.check_profile(span, name)?;
        let sizes = |flat: &mut Self, cx: &mut Context, list: &[Expr]| {
            list.iter()
                .map(|e| {
                    let k = flat.affine(e, cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
                    usize::try_from(k)
                        .map_err(|_| flat.error(Code::ArrayShape, e.span, format!("the size {k} is negative")))
                })
                .collect::<Result<Vec<usize>, Fail>>()
        };
        match name {
            "zeros" | "ones" => sizes(self, cx, list),
            "fill" => {
                let mut shape = sizes(self, cx, list.get(1..).unwrap_or(&[]))?;
                shape.extend(list.first().map_or(Ok(Vec::new()), |value| self.shape(value, cx))?);
                Ok(shape)
            }
            "identity" => Ok(sizes(self, cx, list)?.iter().flat_map(|&n| [n, n]).collect()),
            "linspace" => sizes(self, cx, list.get(2..3).unwrap_or(&[])),
            "size" if list.len() == 1 => Ok(vec![self.shape(&list[0], cx)?.len()]),
            _ if ARRAY_FUNCTIONS.contains(&name) => self.shape_of_array_function(span, name, list, cx),
            "der" | "pre" | "noEvent" | "edge" | "change" | "homotopy" | "integer" | "delay" => {
                list.first().map_or(Ok(Vec::new()), |e| self.shape(e, cx))
            }
            "smooth" => list.get(1).map_or(Ok(Vec::new()), |e| self.shape(e, cx)),
            "size" | "ndims" | "sum" | "product" | "initial" | "terminal" | "sample" | "Integer" | "String" => {
                Ok(Vec::new())
            }
            "min" | "max" if list.len() == 1 => Ok(Vec::new()),
            _ if Function::from_name(name).is_some() || name == "semiLinear" => {
                for argument in list {
                    let shape = self.shape(argument, cx)?;
                    if !shape.is_empty() {
                        return Ok(shape);
                    }
                }
                Ok(Vec::new())
            }
            _ => self.shape_of_user_call(span, function, arguments, cx),
        }
    }
}

fn call_expr(span: Span, name: &str, list: &[Expr]) -> Expr {
    let ident = hyd_syntax::tree::Ident { name: name.into(), span };
    let part = hyd_syntax::tree::RefPart { name: ident, subscripts: Vec::new() };
    let function = ComponentRef { global: false, parts: vec![part], span };
    let arguments = Arguments::List { positional: list.to_vec(), named: Vec::new() };
    Expr { kind: ExprKind::Call(function, arguments), span }
}
