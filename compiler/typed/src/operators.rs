//! Operators that a record declares for itself, and its constructors (Modelica 3.6, chapter 14).
//!
//! `operator record R` holds `operator '+'` with functions in it, or `operator function '+'`.  Which of them is meant is chosen in
//! `hyd_instance::operators`.  Operands with more dimensions than the inputs are taken element by element, as arguments of calls are (12.4.6).

use std::rc::Rc;

use hyd_instance::operators::Operands;
use hyd_instance::{ClassId, LocalClass, ScalarType, Scopes};
use hyd_source::{Reported, Span};
use hyd_syntax::tree::{self as text, ComponentRef};

use crate::elaborate::Elaborator;
use crate::expression::{Call, Callee, Expr, Kind};
use crate::types::{Base, RecordType, Type};

impl Elaborator<'_, '_> {
    /// A call of a constructor that the record declares; `None` where none takes such arguments.
    pub(crate) fn own_constructor(
        &mut self,
        record: &LocalClass,
        positional: &[Expr],
        named: &[(text::Ident, Expr)],
    ) -> Result<Option<LocalClass>, Reported> {
        for function in self.scopes.overloads(record.class, "'constructor'") {
            let signature = self.signature(&function)?;
            let known = named.iter().all(|(name, _)| signature.inputs.iter().any(|(input, _)| *input == name.name));
            let fits = known
                && positional.len() + named.len() <= signature.inputs.len()
                && self.scopes.required_inputs(&function)? <= positional.len() + named.len()
                && positional
                    .iter()
                    .zip(&signature.inputs)
                    .all(|(given, (_, wanted))| fits(&given.ty, wanted).is_some());
            if fits {
                return Ok(Some(function));
            }
        }
        Ok(None)
    }

    fn operator_call(&mut self, span: Span, function: LocalClass, arguments: Vec<Expr>) -> Result<Expr, Reported> {
        let ty = self.type_of_call(&function, &arguments, &[])?;
        let part = |name: &text::Name| text::RefPart {
            name: text::Ident { name: name.clone(), span },
            subscripts: Vec::new(),
        };
        let parts = self.scopes.table.class(function.class).path.iter().map(part).collect();
        let name = Rc::new(ComponentRef { global: true, parts, span });
        let call = Call { function: Callee::Class(function), name, positional: arguments, named: Vec::new() };
        Ok(Expr { kind: Kind::Call(Box::new(call)), ty, span })
    }
}

impl<'s> Operands<'s> for Elaborator<'_, 's> {
    type Operand = Expr;
    type Input = Type;

    fn scopes(&mut self) -> &mut Scopes<'s> {
        self.scopes
    }

    fn class_of(&self, operand: &Expr) -> Option<ClassId> {
        class_of(&operand.ty)
    }

    fn inputs(&mut self, function: &LocalClass) -> Result<Vec<Type>, Reported> {
        Ok(self.signature(function)?.inputs.iter().map(|(_, ty)| ty.clone()).collect())
    }

    fn rank(&self, input: &Type) -> usize {
        input.rank
    }

    fn more(&mut self, operand: &Expr, input: &Type) -> Option<usize> {
        fits(&operand.ty, input)
    }

    fn call(&mut self, span: Span, function: &LocalClass, operands: Vec<Expr>) -> Result<Expr, Reported> {
        self.operator_call(span, function.clone(), operands)
    }
}

/// The class of a record that may declare operators.
fn class_of(ty: &Type) -> Option<ClassId> {
    match &ty.base {
        Base::Record(record) => record.class,
        _ => None,
    }
}

/// The dimensions that an argument has more than an input that it fits; `None` where it does not.
fn fits(given: &Type, wanted: &Type) -> Option<usize> {
    let same = match (&given.base, &wanted.base) {
        (Base::Record(a), Base::Record(b)) => alike(a, b),
        (Base::Scalar(ScalarType::Integer), Base::Scalar(ScalarType::Real)) => true,
        (Base::Scalar(a), Base::Scalar(b)) => a == b,
        _ => false,
    };
    if same { given.rank.checked_sub(wanted.rank) } else { None }
}

/// Records of the same fields (6.7): one may stand for the other.
fn alike(a: &RecordType, b: &RecordType) -> bool {
    a.fields.len() == b.fields.len() && a.fields.iter().zip(&b.fields).all(|((x, _), (y, _))| x == y)
}
