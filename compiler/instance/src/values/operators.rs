//! Which function of a record an operator means (Modelica 3.6, chapter 14), for values before the run and for expressions of it.
//!
//! An operator whose operand is a record is a call of the function whose inputs fit with the fewest dimensions more: all by type, or after
//! a number has been made a record by a constructor of one argument.  What an operand is, is the matter of whoever operates.

use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{BinaryOp, UnaryOp};

use crate::classes::class::ClassId;
use crate::instantiation::instance::LocalClass;
use crate::instantiation::scopes::Scopes;

/// Whoever knows operands and calls functions with them.
pub trait Operands<'s> {
    /// An operand, or the result of an operator.
    type Operand: Clone;
    /// What an input of a function takes.
    type Input;
    /// What names mean.
    fn scopes(&mut self) -> &mut Scopes<'s>;
    /// The class of a record, or of the records of an array.
    fn class_of(&self, operand: &Self::Operand) -> Option<ClassId>;
    /// The inputs of a function in their order.
    fn inputs(&mut self, function: &LocalClass) -> Result<Vec<Self::Input>, Reported>;
    /// How many dimensions an input has.
    fn rank(&self, input: &Self::Input) -> usize;
    /// The dimensions that an operand has more than an input that it fits; `None` where it does not.
    fn more(&mut self, operand: &Self::Operand, input: &Self::Input) -> Option<usize>;
    /// A call of a function with these values of its first inputs.
    fn call(
        &mut self,
        span: Span,
        function: &LocalClass,
        operands: Vec<Self::Operand>,
    ) -> Result<Self::Operand, Reported>;
}

/// `a op b` where one of them is a record; `None` where the record declares no such operator.
pub fn operate_on_two<'s, O: Operands<'s>>(
    of: &mut O,
    span: Span,
    op: BinaryOp,
    (a, b): (&O::Operand, &O::Operand),
) -> Result<Option<O::Operand>, Reported> {
    let name = op.function_name();
    let classes: Vec<ClassId> = [a, b].into_iter().filter_map(|operand| of.class_of(operand)).collect();
    let mut functions: Vec<LocalClass> = Vec::new();
    for &class in &classes {
        for function in of.scopes().overloads(class, name) {
            if !functions.iter().any(|known| known.class == function.class) {
                functions.push(function);
            }
        }
    }
    let Some(&class) = classes.first().filter(|_| !functions.is_empty()) else { return Ok(None) };
    if op.is_element_by_element() {
        // Of elements only functions of scalars tell (10.6.3): `'*'` of two vectors is something else.
        let mut scalar = Vec::with_capacity(functions.len());
        for function in functions {
            if of.inputs(&function)?.iter().take(2).all(|input| of.rank(input) == 0) {
                scalar.push(function);
            }
        }
        functions = scalar;
    }
    let plain = vec![a.clone(), b.clone()];
    if let Some(function) = fitting(of, &functions, &plain)? {
        return of.call(span, &function, plain).map(Some);
    }
    let mut made = Vec::with_capacity(2);
    for operand in plain {
        made.push(match of.class_of(&operand) {
            Some(_) => operand,
            None => match made_of_number(of, span, class, operand)? {
                Some(record) => record,
                None => break,
            },
        });
    }
    if made.len() == 2
        && let Some(function) = fitting(of, &functions, &made)?
    {
        return of.call(span, &function, made).map(Some);
    }
    let message = format!("the record declares no {name} for these operands");
    Err(of.scopes().error(Code::TypeMismatch, span, message))
}

/// `-a` or `not a` of a record; `None` where the record declares no such operator.
pub fn operate_on_one<'s, O: Operands<'s>>(
    of: &mut O,
    span: Span,
    op: UnaryOp,
    a: &O::Operand,
) -> Result<Option<O::Operand>, Reported> {
    let Some(class) = of.class_of(a) else { return Ok(None) };
    let name = match op {
        UnaryOp::Minus => "'-'",
        UnaryOp::Not => "'not'",
        UnaryOp::Plus => return Ok(Some(a.clone())),
    };
    let functions = of.scopes().overloads(class, name);
    if functions.is_empty() {
        return Ok(None);
    }
    let one = vec![a.clone()];
    match fitting(of, &functions, &one)? {
        Some(function) => of.call(span, &function, one).map(Some),
        None => {
            let message = format!("the record declares no {name} of one operand");
            Err(of.scopes().error(Code::TypeMismatch, span, message))
        }
    }
}

/// The function whose inputs the operands fit with the fewest dimensions more: they are all that has no default.
fn fitting<'s, O: Operands<'s>>(
    of: &mut O,
    functions: &[LocalClass],
    operands: &[O::Operand],
) -> Result<Option<LocalClass>, Reported> {
    let mut best: Option<(usize, &LocalClass)> = None;
    for function in functions {
        let inputs = of.inputs(function)?;
        if inputs.len() < operands.len() || of.scopes().required_inputs(function)? != operands.len() {
            continue;
        }
        let more: Option<Vec<usize>> =
            operands.iter().zip(&inputs).map(|(operand, input)| of.more(operand, input)).collect();
        let Some(outer) = more.map(|more| more.into_iter().max().unwrap_or(0)) else { continue };
        if best.is_none_or(|(least, _)| outer < least) {
            best = Some((outer, function));
        }
    }
    Ok(best.map(|(_, function)| function.clone()))
}

/// A number as a record, by the first constructor that takes it alone.
fn made_of_number<'s, O: Operands<'s>>(
    of: &mut O,
    span: Span,
    class: ClassId,
    number: O::Operand,
) -> Result<Option<O::Operand>, Reported> {
    for constructor in of.scopes().overloads(class, "'constructor'") {
        let inputs = of.inputs(&constructor)?;
        let takes_one = !inputs.is_empty() && of.scopes().required_inputs(&constructor)? <= 1;
        if takes_one && of.more(&number, &inputs[0]).is_some() {
            return of.call(span, &constructor, vec![number]).map(Some);
        }
    }
    Ok(None)
}
