//! Operators that a record declares for itself, and its constructors (Modelica 3.6, chapter 14).
//!
//! `operator record R` holds `operator '+'` with functions in it, or `operator function '+'`.  An operator whose operand is such a record
//! is a call of the function whose inputs fit: all by type, or after a number has been made a record by a constructor of one
//! argument.  Operands with more dimensions than the inputs are taken element by element, as arguments of calls are (12.4.6).

use std::rc::Rc;

use hyd_instance::{ClassId, LocalClass, ScalarType};
use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{self as text, BinaryOp, ComponentRef, UnaryOp};

use crate::elaborate::Elaborator;
use crate::expression::{Call, Callee, Expr, Kind};
use crate::types::{Base, RecordType, Type};

/// How many dimensions more the arguments have than inputs that they fit.
struct Fit {
    function: LocalClass,
    outer: usize,
}

impl Elaborator<'_, '_> {
    /// `a op b` where one of them is a record; `None` where the record declares no operators.
    pub(crate) fn operate(&mut self, span: Span, op: BinaryOp, a: &Expr, b: &Expr) -> Result<Option<Expr>, Reported> {
        let name = op.function_name();
        let classes: Vec<ClassId> = [a, b].into_iter().filter_map(|e| class_of(&e.ty)).collect();
        let mut functions = Vec::new();
        for &class in &classes {
            for function in self.scopes.overloads(class, name) {
                if !functions.iter().any(|known: &LocalClass| known.class == function.class) {
                    functions.push(function);
                }
            }
        }
        if functions.is_empty() {
            return Ok(None);
        }
        if op.is_element_by_element() {
            // Of elements only functions of scalars tell (10.6.3): `'*'` of two vectors is something else.
            let mut scalar = Vec::with_capacity(functions.len());
            for function in functions {
                let signature = self.signature(&function)?;
                if signature.inputs.iter().take(2).all(|(_, wanted)| wanted.rank == 0) {
                    scalar.push(function);
                }
            }
            functions = scalar;
        }
        let plain = [a.clone(), b.clone()];
        if let Some(fit) = self.fitting(&functions, &plain)? {
            return self.operator_call(span, fit.function, plain.to_vec()).map(Some);
        }
        // A number becomes a record.
        if let Some(&class) = classes.first() {
            let mut made = Vec::with_capacity(2);
            for operand in [a, b] {
                made.push(match operand.ty.is_record() {
                    true => operand.clone(),
                    false => match self.construct_from(class, operand)? {
                        Some(record) => record,
                        None => break,
                    },
                });
            }
            if made.len() == 2
                && let Some(fit) = self.fitting(&functions, &made)?
            {
                return self.operator_call(span, fit.function, made).map(Some);
            }
        }
        let message = format!("the record declares no {name} for these operands");
        Err(self.error(Code::TypeMismatch, span, message))
    }

    /// `-a` of a record; `None` where the record declares no such operator.
    pub(crate) fn operate_alone(&mut self, span: Span, op: UnaryOp, a: &Expr) -> Result<Option<Expr>, Reported> {
        let Some(class) = class_of(&a.ty) else { return Ok(None) };
        let name = match op {
            UnaryOp::Minus => "'-'",
            UnaryOp::Plus => return Ok(Some(a.clone())),
            UnaryOp::Not => "'not'",
        };
        let functions = self.scopes.overloads(class, name);
        if functions.is_empty() {
            return Ok(None);
        }
        match self.fitting(&functions, std::slice::from_ref(a))? {
            Some(fit) => self.operator_call(span, fit.function, vec![a.clone()]).map(Some),
            None => Err(self.error(Code::TypeMismatch, span, format!("the record declares no {name} of one operand"))),
        }
    }

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

    fn construct_from(&mut self, class: ClassId, number: &Expr) -> Result<Option<Expr>, Reported> {
        let one = std::slice::from_ref(number);
        match self.own_constructor(&LocalClass::plain(class), one, &[])? {
            Some(function) => self.operator_call(number.span, function, vec![number.clone()]).map(Some),
            None => Ok(None),
        }
    }

    /// The function whose inputs the arguments fit with the fewest dimensions more.
    fn fitting(&mut self, functions: &[LocalClass], arguments: &[Expr]) -> Result<Option<Fit>, Reported> {
        let mut best: Option<Fit> = None;
        for function in functions {
            let signature = self.signature(function)?;
            if signature.inputs.len() < arguments.len() || self.scopes.required_inputs(function)? != arguments.len() {
                continue;
            }
            let more: Option<Vec<usize>> =
                arguments.iter().zip(&signature.inputs).map(|(given, (_, wanted))| fits(&given.ty, wanted)).collect();
            let Some(outer) = more.map(|more| more.into_iter().max().unwrap_or(0)) else { continue };
            if best.as_ref().is_none_or(|best| outer < best.outer) {
                best = Some(Fit { function: function.clone(), outer });
            }
        }
        Ok(best)
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
