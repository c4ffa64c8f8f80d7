//! Statements and equations: their expressions typed, what they say sorted out.

use std::rc::Rc;

use hyd_instance::{Env, InstId, ScalarType, Value};
use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{self as text, Arguments, ComponentRef, ExprKind, Name, Variability};

use crate::elaborate::Elaborator;
use crate::expression::{Callee, Expr, Kind};
use crate::statement::{Assertion, Equation, EquationKind, Overdetermined, Statement, StatementKind};
use crate::types::{Base, Type};

impl Elaborator<'_, '_> {
    /// Statements in their order.
    pub fn statements(&mut self, list: &[text::Statement]) -> Vec<Statement> {
        list.iter().map(|statement| self.statement(statement)).collect()
    }

    fn statement(&mut self, statement: &text::Statement) -> Statement {
        let kind = self.tried(|own| own.statement_kind(statement)).unwrap_or_else(StatementKind::Failed);
        Statement { kind, span: statement.span }
    }

    fn statement_kind(&mut self, statement: &text::Statement) -> Result<StatementKind, Reported> {
        use text::StatementKind as Text;
        Ok(match &statement.kind {
            Text::Assign(target, value) => {
                let value = self.expr(value)?;
                StatementKind::Assign(self.target(target)?, value)
            }
            Text::AssignTuple(targets, function, arguments) => {
                let call = self.call(statement.span, function, arguments)?;
                let mut typed = Vec::with_capacity(targets.len());
                for target in targets {
                    typed.push(target.as_ref().map(|target| self.target(target)).transpose()?);
                }
                StatementKind::AssignTuple(typed, call)
            }
            Text::Call(function, arguments) => self.procedure(statement.span, function, arguments)?,
            Text::If(branches) => {
                let mut typed = Vec::with_capacity(branches.len());
                for (condition, body) in branches {
                    let condition = condition.as_ref().map(|condition| self.deferred(condition));
                    typed.push((condition, self.statements(body)));
                }
                StatementKind::If(typed)
            }
            Text::For(iterators, body) => {
                let (iterators, body) = self.with_iterators(iterators, false, |own| Ok(own.statements(body)))?;
                StatementKind::For(iterators, body)
            }
            Text::While(condition, body) => {
                let condition = self.expr(condition)?;
                StatementKind::While(condition, self.statements(body))
            }
            Text::When(branches) => {
                let outside = std::mem::replace(&mut self.in_when, true);
                let typed = branches
                    .iter()
                    .map(|(c, body)| Ok((self.expr(c)?, self.statements(body))))
                    .collect::<Result<_, Reported>>();
                self.in_when = outside;
                StatementKind::When(typed?)
            }
            Text::Break => StatementKind::Break,
            Text::Return => StatementKind::Return,
        })
    }

    /// The left side of an assignment.
    fn target(&mut self, target: &ComponentRef) -> Result<Expr, Reported> {
        if self.in_function && self.local_type(target).is_none() {
            let message = format!("`{}` is not declared in this function", target.parts[0].name.name);
            return Err(self.error(Code::UnknownName, target.span, message));
        }
        let target = self.reference(target)?;
        match target.kind {
            Kind::Variable(_) | Kind::Local(_) => Ok(target),
            _ => Err(self.error(Code::Misplaced, target.span, "only variables can be assigned")),
        }
    }

    /// A call that stands by itself in an algorithm.
    fn procedure(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
    ) -> Result<StatementKind, Reported> {
        Ok(match function.parts[0].name.name.as_ref() {
            "assert" => StatementKind::Assert(self.assertion(span, arguments)?),
            name @ ("reinit" | "terminate") if self.in_function || !self.in_when => {
                let message = format!("`{name}` is allowed only inside `when`");
                return Err(self.error(Code::Misplaced, span, message));
            }
            "terminate" => StatementKind::Terminate(self.text_of_end(span, arguments)?),
            "reinit" => {
                let (state, value) = self.restart(span, arguments)?;
                StatementKind::Reinit(state, value)
            }
            _ => {
                let call = self.call(span, function, arguments)?;
                match self.ends_with(&call) {
                    Some(text) => {
                        let kind = Kind::Boolean(false);
                        let condition = Expr { kind, ty: Type::scalar(ScalarType::Boolean), span };
                        StatementKind::Assert(Assertion { condition, text, error: true })
                    }
                    None => StatementKind::Call(call),
                }
            }
        })
    }

    /// The text that a call ends the run with, where it calls a function for that.
    fn ends_with(&mut self, call: &Expr) -> Option<Expr> {
        let Kind::Call(call) = &call.kind else { return None };
        let Callee::Class(class) = &call.function else { return None };
        let def = self.scopes.table.class(class.class).def.clone();
        let text::ClassBody::Long { external: Some(external), .. } = &def.body else { return None };
        let is_error = external.call.as_ref().is_some_and(|call| hyd_instance::external::is_error(&call.name.name));
        let text = call.positional.first().or(call.named.first().map(|(_, text)| text));
        text.filter(|_| is_error).cloned()
    }

    /// The arguments of an `assert`, by position or name.
    fn assertion(&mut self, span: Span, arguments: &Arguments) -> Result<Assertion, Reported> {
        let wrong = "`assert` takes a condition and a message";
        let Arguments::List { positional, named } = arguments else {
            return Err(self.error(Code::BadArguments, span, wrong));
        };
        let part = |k: usize, name: &str| {
            let by_name = named.iter().find(|(n, _)| n.name.as_ref() == name).map(|(_, e)| e);
            positional.get(k).or(by_name)
        };
        let unknown = named.iter().find(|(n, _)| !["condition", "message", "level"].contains(&n.name.as_ref()));
        let (Some(condition), Some(text), None) = (part(0, "condition"), part(1, "message"), unknown) else {
            return Err(self.error(Code::BadArguments, span, wrong));
        };
        let error = match part(2, "level").map(|level| self.scopes.evaluate(level, self.scope, &Env::default())) {
            Some(Ok(Value::Enumeration(_, k))) => k != 1,
            Some(Err(Reported)) => return Err(Reported),
            _ => true,
        };
        Ok(Assertion { condition: self.expr(condition)?, text: self.deferred(text), error })
    }

    fn text_of_end(&mut self, span: Span, arguments: &Arguments) -> Result<Expr, Reported> {
        match arguments {
            Arguments::List { positional, .. } if positional.len() == 1 => Ok(self.deferred(&positional[0])),
            _ => Err(self.error(Code::BadArguments, span, "`terminate` takes a text")),
        }
    }

    fn restart(&mut self, span: Span, arguments: &Arguments) -> Result<(Expr, Expr), Reported> {
        let (state, value) = match arguments {
            Arguments::List { positional, .. } if positional.len() == 2 => (&positional[0], &positional[1]),
            _ => return Err(self.error(Code::BadArguments, span, "`reinit` takes a state and its new value")),
        };
        if !matches!(state.kind, ExprKind::Ref(_)) {
            return Err(self.error(Code::BadArguments, state.span, "`reinit` needs a variable"));
        }
        Ok((self.expr(state)?, self.expr(value)?))
    }

    /// An equation; what has no meaning in it is said where it is reached.
    pub fn equation(&mut self, equation: &text::Equation) -> Equation {
        let kind = self.tried(|own| own.equation_kind(equation)).unwrap_or_else(EquationKind::Failed);
        Equation { kind, span: equation.span }
    }

    fn equations(&mut self, list: &[text::Equation]) -> Vec<Equation> {
        list.iter().map(|equation| self.equation(equation)).collect()
    }

    fn equation_kind(&mut self, equation: &text::Equation) -> Result<EquationKind, Reported> {
        use text::EquationKind as Text;
        Ok(match &equation.kind {
            Text::Equal(left, right) => self.equal(equation, left, right)?,
            Text::Connect(a, b) => match (self.connector(a)?, self.connector(b)?) {
                (Some(a), Some(b)) => EquationKind::Connect(a, b),
                // A connection of what does not exist does not exist.
                _ => EquationKind::Fields(Vec::new()),
            },
            Text::For(iterators, body) => {
                let (iterators, body) = self.with_iterators(iterators, false, |own| Ok(own.equations(body)))?;
                EquationKind::For(iterators, body)
            }
            Text::If(branches) => {
                let mut typed = Vec::with_capacity(branches.len());
                for (condition, body) in branches {
                    let condition = condition.as_ref().map(|condition| self.expr(condition)).transpose()?;
                    typed.push((condition, self.equations(body)));
                }
                EquationKind::If(typed)
            }
            Text::When(branches) => {
                let outside = std::mem::replace(&mut self.in_when, true);
                let typed = branches
                    .iter()
                    .map(|(c, body)| Ok((self.expr(c)?, self.equations(body))))
                    .collect::<Result<_, Reported>>();
                self.in_when = outside;
                EquationKind::When(typed?)
            }
            Text::Call(function, arguments) => self.effect(equation.span, function, arguments)?,
        })
    }

    /// A call that stands by itself among the equations.
    fn effect(&mut self, span: Span, function: &ComponentRef, arguments: &Arguments) -> Result<EquationKind, Reported> {
        let name = function.parts[0].name.name.clone();
        let (code, message) = match name.as_ref() {
            "assert" => return Ok(EquationKind::Assert(self.assertion(span, arguments)?)),
            "terminate" if self.in_when => return Ok(EquationKind::Terminate(self.text_of_end(span, arguments)?)),
            "reinit" if self.in_when => {
                let (state, value) = self.restart(span, arguments)?;
                return Ok(EquationKind::Reinit(state, value));
            }
            "reinit" | "terminate" => (Code::Misplaced, format!("`{name}` is allowed only inside `when`")),
            _ if hyd_instance::speaks_of_connections(function) => {
                return self.overdetermined(span, function, arguments);
            }
            _ => {
                let call = self.call(span, function, arguments)?;
                if matches!(call.kind, Kind::Call(_)) {
                    return Ok(EquationKind::Call(call));
                }
                (Code::Misplaced, "a call by itself determines nothing here".into())
            }
        };
        Err(self.error(code, span, message))
    }

    /// `Connections.branch`, `root` and `potentialRoot`; nothing where what they name does not exist.
    fn overdetermined(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
    ) -> Result<EquationKind, Reported> {
        let name = &function.parts[1].name.name;
        let (positional, named): (&[text::Expr], &[_]) = match arguments {
            Arguments::List { positional, named } => (positional, named),
            Arguments::Reduction(..) => (&[], &[]),
        };
        let priority = named.iter().find(|(n, _)| &*n.name == "priority" && named.len() == 1).map(|(_, value)| value);
        let records = match (name.as_ref(), positional, priority) {
            ("branch", [a, b], None) if named.is_empty() => vec![a, b],
            ("root", [a], None) if named.is_empty() => vec![a],
            ("potentialRoot", [a, _], None) if named.is_empty() => vec![a],
            ("potentialRoot", [a], _) if named.len() == usize::from(priority.is_some()) => vec![a],
            ("branch" | "root" | "potentialRoot", ..) => {
                let takes = if &**name == "branch" { "two records" } else { "a record" };
                return Err(self.error(Code::BadArguments, span, format!("`Connections.{name}` takes {takes}")));
            }
            ("uniqueRoot" | "uniqueRootIndices", ..) => {
                let message = format!("`Connections.{name}` is outside the language profile");
                return Err(self.error(Code::OutsideProfile, span, message));
            }
            _ => {
                let message = format!("there is no `Connections.{name}`");
                let known = ["branch", "root", "potentialRoot", "isRoot", "rooted"];
                let error = Diagnostic::error(Code::UnknownName, message).at(span, "");
                self.scopes.table.report(error.meant(function.parts[1].name.span, name, known));
                return Err(Reported);
            }
        };
        let mut typed = Vec::with_capacity(2);
        for record in records {
            let ExprKind::Ref(reference) = &record.kind else {
                let message = format!("`Connections.{name}` takes a variable of a connector");
                return Err(self.error(Code::BadArguments, record.span, message));
            };
            match self.connector(reference)? {
                Some(record) => typed.push(record),
                None => return Ok(EquationKind::Fields(Vec::new())),
            }
        }
        let last = typed.pop().ok_or(Reported)?;
        Ok(EquationKind::Overdetermined(match (typed.pop(), name.as_ref()) {
            (Some(first), _) => Overdetermined::Branch(first, last),
            (None, "root") => Overdetermined::Root(last),
            (None, _) => {
                let priority = match positional.get(1).or(priority) {
                    Some(expr) => self.scopes.evaluate(expr, self.scope, &Env::default())?,
                    None => Value::Integer(0),
                };
                let Value::Integer(priority) = priority else {
                    return Err(self.error(Code::TypeMismatch, span, "the priority must be an Integer"));
                };
                Overdetermined::PotentialRoot(last, priority)
            }
        }))
    }

    /// An equation between records is one between their fields.
    fn equal(
        &mut self,
        equation: &text::Equation,
        left: &text::Expr,
        right: &text::Expr,
    ) -> Result<EquationKind, Reported> {
        if let Some(names) = self.fields_determined(left).or_else(|| self.fields_determined(right)) {
            self.scopes.check_record(self.scope, left)?;
            self.scopes.check_record(self.scope, right)?;
            let mut fields = Vec::with_capacity(names.len());
            for name in names {
                let left = self.scopes.field_of(self.scope, left, &name)?;
                let right = self.scopes.field_of(self.scope, right, &name)?;
                let kind = text::EquationKind::Equal(left, right);
                fields.push(self.equation(&text::Equation { kind, description: None, span: equation.span }));
            }
            return Ok(EquationKind::Fields(fields));
        }
        if let Some(fields) = self.equal_records(equation, left, right)? {
            return Ok(EquationKind::Fields(fields));
        }
        if let ExprKind::Tuple(targets) = &left.kind
            && targets.len() > 1
        {
            let call = self.expr(right)?;
            if !matches!(call.kind, Kind::Call(_) | Kind::Record(_)) {
                let message = "several results come only from a function";
                return Err(self.error(Code::TypeMismatch, right.span, message));
            }
            let mut typed = Vec::with_capacity(targets.len());
            for target in targets {
                typed.push(target.as_ref().map(|target| self.expr(target)).transpose()?);
            }
            return Ok(EquationKind::Outputs(typed, call));
        }
        Ok(EquationKind::Equal(self.expr(left)?, self.expr(right)?))
    }

    /// An equation between expressions that are records, field by field; `None` where one of them is none.
    fn equal_records(
        &mut self,
        equation: &text::Equation,
        left: &text::Expr,
        right: &text::Expr,
    ) -> Result<Option<Vec<Equation>>, Reported> {
        // Only what computes: everything else has a name, which is dealt with before.
        let computes = |e: &text::Expr| {
            matches!(e.kind, ExprKind::Binary(..) | ExprKind::Unary(..) | ExprKind::Call(..) | ExprKind::If(..))
        };
        if !computes(left) && !computes(right) {
            return Ok(None);
        }
        let (a, b) = (self.expr(left)?, self.expr(right)?);
        let (Base::Record(record), Base::Record(_)) = (&a.ty.base, &b.ty.base) else { return Ok(None) };
        let mut fields = Vec::with_capacity(record.fields.len());
        for (name, _) in &record.fields {
            let field = |whole: &Expr| {
                let ty = whole.ty.field(name).unwrap_or(Type::NONE);
                let ident = text::Ident { name: name.clone(), span: whole.span };
                Expr { kind: Kind::Field(Box::new(whole.clone()), ident), ty, span: whole.span }
            };
            let kind = EquationKind::Equal(field(&a), field(&b));
            fields.push(Equation { kind, span: equation.span });
        }
        Ok(Some(fields))
    }

    /// The fields that an equation determines, of a component that is a record.  Those that are constants or final have their values
    /// from elsewhere.
    fn fields_determined(&mut self, expr: &text::Expr) -> Option<Vec<Name>> {
        let ExprKind::Ref(reference) = &expr.kind else { return None };
        if self.local_type(reference).is_some() {
            return None;
        }
        let resolved = self.scopes.quietly(|scopes| {
            scopes.resolve(self.scope, reference).map(|found| match found {
                hyd_instance::Resolved::Variable(steps) => Some(steps[steps.len() - 1].0),
                _ => None,
            })
        });
        let last = resolved.ok()??;
        if !self.scopes.is_record(last) {
            return None;
        }
        let whole = self.scopes.variability(last);
        let open = |&&child: &&InstId| {
            let is_final = self.scopes.instances[child].primitive.as_ref().is_some_and(|p| p.is_final);
            let own = self.scopes.variability(child);
            own == whole || own > Variability::Parameter || own == Variability::Parameter && !is_final
        };
        Some(
            self.scopes.instances[last]
                .children
                .iter()
                .filter(open)
                .map(|&c| self.scopes.instances[c].name.clone())
                .collect(),
        )
    }

    /// The component that an end of a connection names; `None` if it, or what it is in, does not exist.
    fn connector(&mut self, reference: &ComponentRef) -> Result<Option<Expr>, Reported> {
        if self.leads_to_absent(reference) {
            return Ok(None);
        }
        let expr = self.reference(reference)?;
        match &expr.kind {
            Kind::Variable(variable) if self.scopes.instances[variable.last()].absent => Ok(None),
            Kind::Variable(_) => Ok(Some(expr)),
            _ => {
                let message = format!("`{}` is not a connector", self.scopes.table.files.snippet(reference.span));
                Err(self.error(Code::ConnectorMismatch, reference.span, message))
            }
        }
    }

    fn leads_to_absent(&self, reference: &ComponentRef) -> bool {
        let mut current = self.scope.inst;
        for part in &reference.parts {
            match self.scopes.instances[current].by_name.get(&part.name.name) {
                Some(&next) => current = self.scopes.part_at(next, &part.subscripts).unwrap_or(next),
                None => return false,
            }
            if self.scopes.instances[current].absent {
                return true;
            }
        }
        false
    }

    /// Messages of what was never reached.
    pub fn say(&mut self, said: &Rc<[Diagnostic]>) -> Reported {
        self.scopes.table.messages.report_all(said.to_vec());
        Reported
    }
}
