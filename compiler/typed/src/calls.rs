//! Calls: functions of the language, functions of the user, constructors of records.

use std::rc::Rc;

use hyd_instance::{Builtin, LocalClass, Resolved, ScalarType};
use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{self as text, Arguments, ClassKind, ComponentRef, Ident, Name};
use hyd_system::math::Function as Named;

use crate::elaborate::{Elaborator, joined};
use crate::expression::{Call, Callee, Construction, Expr, Kind, Local};
use crate::types::{Base, Type};

impl Elaborator<'_, '_> {
    pub(crate) fn call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
    ) -> Result<Expr, Reported> {
        if let Some(Base::Function(result)) = self.local_type(function).map(|ty| &ty.base)
            && function.parts.len() == 1
        {
            let result = Type::clone(result);
            return self.call_of_local(span, function, result, arguments);
        }
        if let Some(array) = self.scopes.array_of_call(self.scope, function, arguments, span) {
            return self.expr(&array);
        }
        let builtin = self.scopes.predefined(self.scope, function);
        let (positional, named) = match arguments {
            Arguments::List { positional, named } => (positional, named),
            Arguments::Reduction(body, iterators) => {
                let Some(builtin) = builtin.filter(|builtin| builtin.is_fold()) else {
                    let message = "only array, sum, product, min and max take `... for ... in ...`";
                    return Err(self.error(Code::BadArguments, span, message));
                };
                let (iterators, body) = self.with_iterators(iterators, false, |own| own.expr(body))?;
                let ty = body.ty.with_rank(0);
                return Ok(Expr { kind: Kind::Reduction(builtin, Box::new(body), iterators), ty, span });
            }
        };
        match builtin {
            Some(builtin) => self.builtin(span, builtin, positional, named, arguments),
            None => self.call_of_class(span, function, positional, named, arguments),
        }
    }

    fn builtin(
        &mut self,
        span: Span,
        builtin: Builtin,
        positional: &[text::Expr],
        named: &[(text::Ident, text::Expr)],
        arguments: &Arguments,
    ) -> Result<Expr, Reported> {
        match builtin {
            Builtin::Reinit => {
                let message = "`reinit` is an equation of its own inside `when`, not a value";
                return Err(self.error(Code::Misplaced, span, message));
            }
            // With elements it is what it makes.
            Builtin::Array => {
                let message = "`array` takes one element or more, by position";
                return Err(self.error(Code::BadArguments, span, message));
            }
            Builtin::Outside(sentence) => return Err(self.error(Code::OutsideProfile, span, sentence)),
            Builtin::Text => {
                let Some(first) = positional.first() else {
                    return Err(self.error(Code::BadArguments, span, "`String` takes a value"));
                };
                let value = self.expr(first)?;
                let ty = Type::scalar(ScalarType::Text);
                return Ok(Expr { kind: Kind::Format(Box::new(value), Rc::new(arguments.clone())), ty, span });
            }
            _ => {}
        }
        let mut list = self.all(positional)?;
        for (name, value) in named {
            let place = argument_place(builtin, &name.name, list.len());
            if place.is_none() {
                let message = format!("`{}` takes its arguments by position", builtin.name());
                return Err(self.error(Code::BadArguments, name.span.to(value.span), message));
            }
            let value = self.expr(value)?;
            list.insert(place.unwrap_or(0).min(list.len()), value);
        }
        let ty = type_of_builtin(builtin, &list);
        Ok(Expr { kind: Kind::Builtin(builtin, list), ty, span })
    }

    fn call_of_class(
        &mut self,
        span: Span,
        function: &ComponentRef,
        positional: &[text::Expr],
        named: &[(text::Ident, text::Expr)],
        arguments: &Arguments,
    ) -> Result<Expr, Reported> {
        let local = self.called_class(function)?;
        let local = self.scopes.constructor_of_object(&local)?.unwrap_or(local);
        let def = self.scopes.table.class(local.class).def.clone();
        let name = Rc::new(function.clone());
        if def.kind == ClassKind::Record && !self.scopes.overloads(local.class, "'constructor'").is_empty() {
            let positional = self.all(positional)?;
            let mut by_name = Vec::with_capacity(named.len());
            for (name, value) in named {
                by_name.push((name.clone(), self.expr(value)?));
            }
            if let Some(function) = self.own_constructor(&local, &positional, &by_name)? {
                let ty = self.type_of_call(&function, &positional, &by_name)?;
                let call = Call { function: Callee::Class(function), name, positional, named: by_name };
                return Ok(Expr { kind: Kind::Call(Box::new(call)), ty, span });
            }
        }
        if def.kind == ClassKind::Record {
            let mut given = self.all(positional)?;
            for (_, value) in named {
                given.push(self.expr(value)?);
            }
            let ty = Type { base: self.record_base(&local)?, rank: 0 };
            let (arguments, scope) = (Rc::new(arguments.clone()), self.scope);
            let made = Construction { record: local, name, arguments, given, scope };
            return Ok(Expr { kind: Kind::Record(Box::new(made)), ty, span });
        }
        if def.kind != ClassKind::Function {
            let message = format!("`{}` is not a function", def.name.name);
            return Err(self.error(Code::BadArguments, function.span, message));
        }
        let (positional, named) = (self.all(positional)?, self.named(named)?);
        let ty = self.type_of_call(&local, &positional, &named)?;
        let call = Call { function: Callee::Class(local), name, positional, named };
        Ok(Expr { kind: Kind::Call(Box::new(call)), ty, span })
    }

    fn named(&mut self, named: &[(text::Ident, text::Expr)]) -> Result<Vec<(text::Ident, Expr)>, Reported> {
        named.iter().map(|(name, value)| Ok((name.clone(), self.expr(value)?))).collect()
    }

    /// A call of the function that an input of the function around is.
    fn call_of_local(
        &mut self,
        span: Span,
        function: &ComponentRef,
        ty: Type,
        arguments: &Arguments,
    ) -> Result<Expr, Reported> {
        let Arguments::List { positional, named } = arguments else {
            let message = "only array, sum, product, min and max take `... for ... in ...`";
            return Err(self.error(Code::BadArguments, span, message));
        };
        let name = Rc::new(function.clone());
        let local = Local { parts: vec![(function.parts[0].name.clone(), Vec::new())], reference: name.clone() };
        let (positional, named) = (self.all(positional)?, self.named(named)?);
        let call = Call { function: Callee::Local(local), name, positional, named };
        Ok(Expr { kind: Kind::Call(Box::new(call)), ty, span })
    }

    /// `function f(a = 1)`
    pub(crate) fn partial(
        &mut self,
        span: Span,
        function: &ComponentRef,
        given: &[(text::Ident, text::Expr)],
    ) -> Result<Expr, Reported> {
        let name = Rc::new(function.clone());
        let (callee, result) = match self.local_type(function).map(|ty| ty.base.clone()) {
            Some(Base::Function(result)) => {
                let parts = vec![(function.parts[0].name.clone(), Vec::new())];
                (Callee::Local(Local { parts, reference: name.clone() }), result)
            }
            _ => {
                let local = self.called_class(function)?;
                let def = self.scopes.table.class(local.class).def.clone();
                if def.kind != ClassKind::Function {
                    let message = format!("`{}` is not a function", def.name.name);
                    return Err(self.error(Code::BadArguments, function.span, message));
                }
                let result = Rc::new(self.type_of_outputs(&local)?);
                (Callee::Class(local), result)
            }
        };
        let call = Call { function: callee, name, positional: Vec::new(), named: self.named(given)? };
        let ty = Type { base: Base::Function(result), rank: 0 };
        Ok(Expr { kind: Kind::Function(Box::new(call)), ty, span })
    }

    /// The type of the first output; an argument with more dimensions than the input asks for one call per element (12.4.6).
    pub(crate) fn type_of_call(
        &mut self,
        local: &LocalClass,
        positional: &[Expr],
        named: &[(text::Ident, Expr)],
    ) -> Result<Type, Reported> {
        let signature = self.signature(local)?;
        let Some((_, first)) = signature.outputs.first() else { return Ok(Type::NONE) };
        let by_name = |name: &Name| named.iter().find(|(n, _)| n.name == *name).map(|(_, e)| e);
        let mut outer = 0;
        for (k, (name, ty)) in signature.inputs.iter().enumerate() {
            if let Some(given) = positional.get(k).or_else(|| by_name(name))
                && given.ty.is_record() == ty.is_record()
            {
                outer = outer.max(given.ty.rank.saturating_sub(ty.rank));
            }
        }
        Ok(first.with_rank(first.rank + outer))
    }

    /// The type of the first output of a function that is called with what it declares.
    pub fn type_of_outputs(&mut self, local: &LocalClass) -> Result<Type, Reported> {
        self.type_of_call(local, &[], &[])
    }

    /// The class that is called.
    pub(crate) fn called_class(&mut self, function: &ComponentRef) -> Result<LocalClass, Reported> {
        let name = || function.parts.iter().map(|p| p.name.name.as_ref()).collect::<Vec<_>>().join(".");
        self.scopes.table.messages.begin();
        let resolved = self.scopes.resolve(self.scope, function);
        let mut said = self.scopes.table.messages.end();
        if resolved.is_err() && function.parts.len() == 1 {
            self.suggest_function(&mut said, &function.parts[0].name);
        }
        self.scopes.table.messages.report_all(said);
        match resolved? {
            Resolved::Class(local) => Ok(local),
            _ => Err(self.error(Code::BadArguments, function.span, format!("`{}` is not a function", name()))),
        }
    }

    /// The message for an unknown name in place of a function speaks of functions.
    fn suggest_function(&mut self, said: &mut [Diagnostic], name: &Ident) {
        if said.iter().all(|d| d.code != Code::UnknownName) {
            return;
        }
        let mut names = self.scopes.visible_classes(self.scope);
        names.extend(Builtin::names().map(Name::from));
        for message in said.iter_mut().filter(|d| d.code == Code::UnknownName) {
            let mut own = message.clone();
            own.message = format!("there is no function `{}` here", name.name);
            // Variables that are spelt alike are no functions.
            own.notes.clear();
            own.proposals.clear();
            *message = own.meant(name.span, &name.name, names.iter().map(|n| n.as_ref()));
        }
    }
}

/// `sample(u)` and `sample(u, clock)`, not `sample(start, interval)`.
pub fn is_clocked_sample(list: &[Expr]) -> bool {
    match list {
        [_] => true,
        [_, clock] => clock.ty.base == Base::Scalar(ScalarType::Clock),
        _ => false,
    }
}

/// The names of what an operator of clocks takes, by place (Modelica 3.6, sections 16.3 and 16.5).
fn argument_place(builtin: Builtin, name: &str, given: usize) -> Option<usize> {
    match (builtin, name) {
        (Builtin::Homotopy, "actual") => Some(0),
        (Builtin::Homotopy, "simplified") => Some(1),
        (Builtin::Clock, "intervalCounter" | "interval" | "condition" | "c") => Some(0),
        (Builtin::Clock, "resolution" | "startInterval") => Some(1),
        (Builtin::Clock, "solverMethod") if given > 0 => Some(1),
        (Builtin::SubSample | Builtin::SuperSample, "factor") => Some(1),
        (Builtin::ShiftSample, "shiftCounter") | (Builtin::BackSample, "backCounter") => Some(1),
        (Builtin::ShiftSample | Builtin::BackSample, "resolution") => Some(2),
        (Builtin::Sample, "clock") => Some(1),
        _ => None,
    }
}

/// The type that a function of the language gives (Modelica 3.6, sections 3.7 and 10.3).
fn type_of_builtin(builtin: Builtin, list: &[Expr]) -> Type {
    use Builtin::*;
    let nth = |k: usize| list.get(k).map_or(Type::NONE, |e| e.ty.clone());
    let real = |rank: usize| Type { base: Base::Scalar(ScalarType::Real), rank };
    let integer = |rank: usize| Type { base: Base::Scalar(ScalarType::Integer), rank };
    let widest = list.iter().map(|e| e.ty.rank).max().unwrap_or(0);
    match builtin {
        Der | Delay | InStream | ActualStream => real(nth(0).rank),
        Homotopy => real(nth(0).rank),
        SemiLinear => real(widest),
        Pre | NoEvent | Transpose | Symmetric => nth(0),
        Smooth => nth(1),
        Edge | Change => Type { base: Base::Scalar(ScalarType::Boolean), rank: nth(0).rank },
        Sample if is_clocked_sample(list) => nth(0),
        Hold | Previous | SubSample | SuperSample | ShiftSample | BackSample | NoClock => nth(0),
        Interval => real(0),
        Clock => Type::scalar(ScalarType::Clock),
        Initial | Terminal | Sample | FirstTick => Type::scalar(ScalarType::Boolean),
        Size => integer(usize::from(list.len() == 1)),
        Ndims => integer(0),
        Zeros | Ones => integer(list.len()),
        Fill => nth(0).with_rank(nth(0).rank + list.len().saturating_sub(1)),
        Identity => integer(2),
        Linspace => real(1),
        Diagonal => nth(0).with_rank(2),
        Cat => joined(list.get(1..).unwrap_or(&[])),
        Vector => nth(0).with_rank(1),
        Matrix => nth(0).with_rank(2),
        Scalar => nth(0).with_rank(0),
        OuterProduct => nth(0).join(&nth(1)).with_rank(2),
        Cross => nth(0).join(&nth(1)).with_rank(1),
        Skew => nth(0).with_rank(2),
        Sum | Product => nth(0).with_rank(0),
        Min | Max if list.len() == 1 => nth(0).with_rank(0),
        Min | Max => joined(list),
        Floored => integer(nth(0).rank),
        Ordinal => integer(nth(0).rank),
        Cardinality => integer(0),
        IsRoot | Rooted => Type::scalar(ScalarType::Boolean),
        Text | InstanceName => Type::scalar(ScalarType::Text),
        Elementary(Named::Sign) => integer(widest),
        Elementary(Named::Abs | Named::Min | Named::Max | Named::Div | Named::Mod | Named::Rem) => {
            match list.iter().all(|e| e.ty.is_integer()) {
                true => integer(widest),
                false => real(widest),
            }
        }
        Elementary(_) => real(widest),
        Array | Reinit | Outside(_) => Type::NONE,
    }
}
