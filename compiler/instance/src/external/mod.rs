//! External functions that are known here, and the objects that some of them work on (Modelica 3.6, sections 12.9 and 12.9.7).
//!
//! An external function is a name and its arguments; what the functions of Modelica's own tables and strings and of LAPACK do is written down in
//! this folder, from their documentation, and computed at translation.  An external object is what its constructor was called with:
//! nothing of it changes in the run.  What a table gives during the run is asked of it piece by piece (`pieces`), so that the flattener can
//! write it as a function like any other.

mod hermite;
mod matrices;
mod matrix_files;
mod pieces;
mod strings;
mod table_1d;
mod table_2d;
mod table_data;
mod table_file;
mod text_files;
mod time_table;

use std::sync::Arc;

use hyd_syntax::tree::Name;

use crate::values::value::Value;

pub use pieces::{Cubic, Outside, Pieces};
pub use table_1d::Table1d;
pub use table_2d::{Patch, Table2d};
pub use time_table::{Stretch, TimeTable};

/// An external object.
#[derive(Debug, PartialEq)]
pub struct Object {
    /// The function that made it.
    pub made_by: Name,
    /// What it is.
    pub kind: ObjectKind,
}

/// The kinds of external objects that are known.
#[derive(Debug, PartialEq)]
pub enum ObjectKind {
    /// Functions of one variable.
    Table1d(Table1d),
    /// Functions of two variables.
    Table2d(Table2d),
    /// Functions of time.
    TimeTable(TimeTable),
}

/// What a call gives.
#[derive(Debug, PartialEq)]
pub struct Given {
    /// The value of the function itself.
    pub value: Option<Value>,
    /// Values of arguments that the function sets, by position.
    pub set: Vec<(usize, Value)>,
}

impl From<Value> for Given {
    fn from(value: Value) -> Self {
        Given { value: Some(value), set: Vec::new() }
    }
}

/// Texts of data files by their names.
pub type DataFiles<'f> = &'f mut dyn FnMut(&Name) -> Result<Arc<str>, String>;

/// What is asked of a table during the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TableFunction {
    /// `getValue` and its derivatives of order 1 and 2 by the clock, of a function of one variable.
    Value1d(u32),
    /// The same of a function of two variables.
    Value2d(u32),
    /// The same of a function of time.
    ValueOfTime(u32),
    /// The next time event.
    NextTimeEvent,
}

impl TableFunction {
    /// The function of this name.
    pub fn of(name: &str) -> Option<Self> {
        let (table, function) = name.strip_prefix("ModelicaStandardTables_")?.split_once('_')?;
        let order = match function {
            "getValue" => Some(0),
            "getDerValue" => Some(1),
            "getDer2Value" => Some(2),
            _ => None,
        };
        match (table, order, function) {
            ("CombiTable1D", Some(order), _) => Some(TableFunction::Value1d(order)),
            ("CombiTable2D", Some(order), _) => Some(TableFunction::Value2d(order)),
            ("CombiTimeTable", Some(order), _) => Some(TableFunction::ValueOfTime(order)),
            ("CombiTimeTable", None, "nextTimeEvent") => Some(TableFunction::NextTimeEvent),
            _ => None,
        }
    }
}

/// A function that ends the run with the text it is given (Modelica 3.6, section 12.9.6.1).
pub fn is_error(name: &str) -> bool {
    name == "ModelicaError"
}

/// A function whose only effect is outside of the model: nothing depends on whether it is run, and where it tells whether that went well,
/// it did.
pub fn is_effect_only(name: &str) -> bool {
    matches!(
        name,
        "ModelicaInternal_print"
            | "ModelicaStreams_closeFile"
            | "ModelicaIO_writeRealMatrix"
            | "ModelicaInternal_removeFile"
    )
}

/// Sets the hidden state of the generator of random numbers xorshift1024* to an array of integers.
pub fn sets_hidden_state(name: &str) -> bool {
    name == "ModelicaRandom_setInternalState_xorshift1024star"
}

/// Draws the next random number of that generator.
pub fn draws_hidden(name: &str) -> bool {
    name == "ModelicaRandom_impureRandom_xorshift1024star"
}

/// What a seed is that time and process would decide elsewhere: a run can be repeated here.
pub const AUTOMATIC_SEED: i64 = 614_657_441;

/// Calls the external function of this name; `None` where it is not known.  `Err`: a sentence.
pub(crate) fn call(name: &str, arguments: &[Value], files: DataFiles<'_>) -> Option<Result<Given, String>> {
    if let Some(rest) = name.strip_prefix("ModelicaStandardTables_") {
        return table(name, rest, arguments, files);
    }
    if name == "ModelicaRandom_automaticGlobalSeed" {
        return Some(Ok(Value::Integer(AUTOMATIC_SEED).into()));
    }
    matrices::call(name, arguments)
        .or_else(|| strings::call(name, arguments))
        .or_else(|| matrix_files::call(name, arguments, &mut *files))
        .or_else(|| text_files::call(name, arguments, files))
}

fn table(name: &str, rest: &str, arguments: &[Value], files: DataFiles<'_>) -> Option<Result<Given, String>> {
    let object = |kind: Result<ObjectKind, String>| {
        kind.map(|kind| Given::from(Value::Object(Arc::new(Object { made_by: name.into(), kind }))))
    };
    Some(match (rest, arguments) {
        ("CombiTable1D_init2" | "CombiTable1D_init3", _) => {
            object(Table1d::made(arguments, files).map(ObjectKind::Table1d))
        }
        ("CombiTable2D_init2" | "CombiTable2D_init3", _) => {
            object(Table2d::made(arguments, files).map(ObjectKind::Table2d))
        }
        ("CombiTimeTable_init2" | "CombiTimeTable_init3", _) => {
            object(TimeTable::made(arguments, files).map(ObjectKind::TimeTable))
        }
        (_, [Value::Object(object), rest_arguments @ ..]) => asked(rest, object, rest_arguments)?,
        _ => return None,
    })
}

/// What a table gives at translation.
fn asked(function: &str, object: &Object, arguments: &[Value]) -> Option<Result<Given, String>> {
    let reals = |pair: [f64; 2]| Value::array(pair.map(Value::Real).to_vec());
    let real = |k: usize| arguments.get(k).and_then(Value::as_real);
    let column = || arguments.first().and_then(Value::as_integer).and_then(|k| usize::try_from(k).ok());
    Some(Ok(match (function, &object.kind) {
        ("CombiTable1D_minimumAbscissa", ObjectKind::Table1d(table)) => Value::Real(table.range().0).into(),
        ("CombiTable1D_maximumAbscissa", ObjectKind::Table1d(table)) => Value::Real(table.range().1).into(),
        ("CombiTimeTable_minimumTime", ObjectKind::TimeTable(table)) => Value::Real(table.range().0).into(),
        ("CombiTimeTable_maximumTime", ObjectKind::TimeTable(table)) => Value::Real(table.range().1).into(),
        ("CombiTable2D_minimumAbscissa", ObjectKind::Table2d(table)) => {
            Given { value: None, set: vec![(1, reals(table.range().map(|(low, _)| low)))] }
        }
        ("CombiTable2D_maximumAbscissa", ObjectKind::Table2d(table)) => {
            Given { value: None, set: vec![(1, reals(table.range().map(|(_, high)| high)))] }
        }
        ("CombiTable1D_getValue", ObjectKind::Table1d(table)) => {
            let pieces = match table.pieces(column()?) {
                Ok(pieces) => pieces,
                Err(sentence) => return Some(Err(sentence)),
            };
            match pieces.value(real(1)?) {
                Some(y) => Value::Real(y).into(),
                None => return Some(Err("the argument is outside the range of the table".to_string())),
            }
        }
        _ => return None,
    }))
}
