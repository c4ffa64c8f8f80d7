//! Functions of the random models, called with numbers in the three ways in which the product runs statements: over values at translation,
//! over nodes where the call is written out, as steps of a compiled body.  The same call is computed without the product.

use hyd_differential::evaluate::number;
use hyd_differential::generate::model;
use hyd_differential::model::{
    Expr, Function, Id, Kind, Local, Model, Operator, Role, Statement, Step, Target, Type, Variable,
};
use hyd_differential::print::{Form, column, text};
use hyd_differential::random::Random;

use crate::ways::{Way, translate};

/// Allowed difference, relative to 1 and the value: sums may be taken in another order.
const ALLOWED: f64 = 1e-9;

/// An input that only the run knows, which keeps the statements behind it from being run before.
const AGAIN: &str = "again_";
const ONCE: &str = "once_";

/// The calls of one model in the three ways.
struct Calls {
    model: Model,
    /// For each call the variables by values, by nodes and by steps, and what they must be.
    of: Vec<([Id; 3], f64)>,
}

/// The same function with all its statements in a loop whose turns the run decides: it turns once.
fn compiled(function: &Function) -> Function {
    let real = |name: &str| Local { name: name.into(), kind: Type::Of(Kind::Real), sizes: Vec::new(), value: None };
    let local = |name: &str| Target::Local(name.into(), Vec::new());
    let mut turn = vec![Step::Assign(local(ONCE), Expr::Number(0.0))];
    turn.extend(function.body.iter().cloned());
    let open = Expr::binary(Operator::Greater, Expr::local(ONCE), Expr::Number(0.0));
    let mut copy = function.clone();
    copy.name = format!("{}_in_the_run", function.name);
    copy.inputs.insert(0, real(AGAIN));
    copy.locals.push(real(ONCE));
    copy.body = vec![Step::Assign(local(ONCE), Expr::local(AGAIN)), Step::While(open, turn)];
    copy
}

/// Numbers for an input; none for records.
fn argument(input: &Local, output: &Local, random: &mut Random) -> Option<Expr> {
    let one = |random: &mut Random| match input.kind {
        Type::Of(Kind::Real) => Some(Expr::Number((random.number(-2.0, 2.0) * 64.0).round() / 64.0)),
        Type::Of(Kind::Integer) => Some(Expr::Number(random.between(1, 5) as f64)),
        _ => None,
    };
    match input.sizes.as_slice() {
        [] => one(random),
        // Where a result has a size of its own, the statements go by that.
        [size] => (0..size.or(*output.sizes.first().unwrap_or(&None)).unwrap_or(3))
            .map(|_| one(random))
            .collect::<Option<_>>()
            .map(Expr::Array),
        _ => None,
    }
}

/// The functions of a model with calls of them.
fn calls(seed: u64) -> Calls {
    let whole = model(seed);
    let mut random = Random::new(seed);
    let mut of = Vec::new();
    let mut made = Model {
        functions: whole.functions.clone(),
        records: whole.records.clone(),
        stop: 1.0,
        order: seed,
        ..Model::default()
    };
    let again = made.add(Variable::new("again", Role::Parameter).valued(Expr::Number(1.0)));
    for function in &whole.functions {
        let is_number = |local: &Local| matches!(local.kind, Type::Of(Kind::Real | Kind::Integer));
        let Some(output) = function.outputs.first().filter(|output| is_number(output)) else { continue };
        let arguments: Option<Vec<Expr>> =
            function.inputs.iter().map(|input| argument(input, output, &mut random)).collect();
        let Some(arguments) = arguments else { continue };
        let call = |name: &str, arguments: Vec<Expr>| {
            let call = Expr::Call(name.into(), arguments);
            if output.sizes.is_empty() { call } else { Expr::call("sum", vec![call]) }
        };
        let Ok(expected) = number(&made, &call(&function.name, arguments.clone())) else { continue };
        let k = of.len();
        let by_values = made.add(
            Variable::new(format!("by_values{k}"), Role::Constant).valued(call(&function.name, arguments.clone())),
        );
        // Sizes and ends of loops stay numbers, so that the statements can be run over nodes.
        let mut opened = arguments;
        for (j, (argument, input)) in opened.iter_mut().zip(&function.inputs).enumerate() {
            if matches!((&*argument, &input.kind), (Expr::Number(_), Type::Of(Kind::Real))) {
                let value = argument.clone();
                let parameter = Variable::new(format!("p{k}_{j}"), Role::Parameter).valued(value);
                *argument = Expr::name(made.add(parameter));
            }
        }
        let by_nodes = made.add(Variable::new(format!("by_nodes{k}"), Role::Algebraic));
        made.statements.push(Statement::Declare(by_nodes, call(&function.name, opened.clone())));
        let steps = compiled(function);
        opened.insert(0, Expr::name(again));
        let by_steps = made.add(Variable::new(format!("by_steps{k}"), Role::Algebraic));
        made.statements.push(Statement::Declare(by_steps, call(&steps.name, opened)));
        made.functions.push(steps);
        of.push(([by_values, by_nodes, by_steps], expected));
    }
    Calls { model: made, of }
}

/// Compares the functions of so many models from a seed; the number of calls, and what differs.
pub(crate) fn compare(first: u64, count: u64) -> (usize, Vec<String>) {
    let (mut compared, mut different) = (0, Vec::new());
    for seed in first..first + count {
        let Calls { model, of } = calls(seed);
        if of.is_empty() {
            continue;
        }
        let written = text(&model, Form::default());
        let run = translate(&written, &[]).and_then(|translated| translated.run(Way::Native, &[0.0, 1.0]));
        let rows = match run {
            Ok(rows) => rows,
            Err(said) => {
                different.push(format!("seed {seed}: {said}\n{written}"));
                continue;
            }
        };
        for (ways, expected) in of {
            for id in ways {
                let name = column(&model, Form::default(), id, 0);
                let found = rows.values(&name).and_then(|values| values.first().copied()).unwrap_or(f64::NAN);
                if (found - expected).abs() <= ALLOWED * expected.abs().max(1.0) {
                    compared += 1;
                } else {
                    different.push(format!("seed {seed}: `{name}` is {found}, not {expected}\n{written}"));
                }
            }
        }
    }
    (compared, different)
}
