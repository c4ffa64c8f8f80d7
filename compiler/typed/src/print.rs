//! Typed expressions as text: every operation with its type, names as what they mean.

use hyd_instance::{ScalarType, Scopes, instance::path};
use hyd_syntax::tree::{BinaryOp, UnaryOp};

use crate::expression::{Callee, Expr, Iterator, Kind};
use crate::types::{Base, Type};

impl std::fmt::Display for Type {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.base {
            Base::Scalar(ScalarType::Enumeration(enumeration)) => write!(f, "{}", enumeration.name)?,
            Base::Scalar(scalar) => write!(f, "{}", scalar.name())?,
            Base::Record(record) => write!(f, "record {}", record.name)?,
            Base::Function(result) => write!(f, "function of {result}")?,
            Base::None => write!(f, "none")?,
        }
        match self.rank {
            0 => Ok(()),
            rank => write!(f, "[{}]", vec![":"; rank].join(", ")),
        }
    }
}

fn sign(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "+",
        BinaryOp::Sub => "-",
        BinaryOp::Mul => "*",
        BinaryOp::Div => "/",
        BinaryOp::Pow => "^",
        BinaryOp::ElementAdd => ".+",
        BinaryOp::ElementSub => ".-",
        BinaryOp::ElementMul => ".*",
        BinaryOp::ElementDiv => "./",
        BinaryOp::ElementPow => ".^",
        BinaryOp::Equal => "==",
        BinaryOp::NotEqual => "<>",
        BinaryOp::Less => "<",
        BinaryOp::LessEqual => "<=",
        BinaryOp::Greater => ">",
        BinaryOp::GreaterEqual => ">=",
        BinaryOp::And => "and",
        BinaryOp::Or => "or",
    }
}

impl Expr {
    /// The expression with what its names mean and, behind each part, its type.
    pub fn describe(&self, scopes: &Scopes<'_>) -> String {
        let all = |list: &[Expr]| list.iter().map(|e| e.describe(scopes)).collect::<Vec<_>>().join(", ");
        let at = |subscripts: &[Expr]| match subscripts {
            [] => String::new(),
            list => format!("[{}]", all(list)),
        };
        let loops = |iterators: &[Iterator]| {
            let one = |i: &Iterator| format!("{} in {}", i.name.name, i.range.describe(scopes));
            iterators.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let text = match &self.kind {
            Kind::Integer(k) => k.to_string(),
            Kind::Real(x) => x.to_string(),
            Kind::Boolean(b) => b.to_string(),
            Kind::Text(text) => format!("{text:?}"),
            Kind::Literal(enumeration, k, _) => {
                format!("{}.{}", enumeration.name, enumeration.literals[*k as usize - 1])
            }
            Kind::Values(enumeration, _) => {
                format!("values of {}", enumeration.as_ref().map_or("Boolean", |enumeration| &enumeration.name))
            }
            Kind::Time => "time".to_string(),
            Kind::Variable(variable) => {
                let mut text = String::new();
                for (k, (inst, subscripts)) in variable.steps.iter().enumerate() {
                    text += &match k {
                        0 => path(&scopes.instances, *inst),
                        _ => format!(".{}", scopes.instances[*inst].name),
                    };
                    text += &at(subscripts);
                }
                text
            }
            Kind::Local(local) => {
                let part = |(name, subscripts): &(hyd_syntax::tree::Ident, Vec<Expr>)| {
                    format!("{}{}", name.name, at(subscripts))
                };
                format!("local {}", local.parts.iter().map(part).collect::<Vec<_>>().join("."))
            }
            Kind::Builtin(builtin, list) => format!("{}({})", builtin.name(), all(list)),
            Kind::Format(value, _) => format!("String({})", value.describe(scopes)),
            Kind::Reduction(builtin, body, iterators) => {
                format!("{}({} for {})", builtin.name(), body.describe(scopes), loops(iterators))
            }
            Kind::Call(call) | Kind::Function(call) => {
                let mut list: Vec<String> = call.positional.iter().map(|e| e.describe(scopes)).collect();
                list.extend(call.named.iter().map(|(name, e)| format!("{} = {}", name.name, e.describe(scopes))));
                let name = match &call.function {
                    Callee::Class(class) => scopes.table.full_name(class.class),
                    Callee::Local(local) => local.name().to_string(),
                };
                let before = if matches!(self.kind, Kind::Function(_)) { "function " } else { "" };
                format!("{before}{name}({})", list.join(", "))
            }
            Kind::Record(made) => {
                format!("{}({})", scopes.table.full_name(made.record.class), all(&made.given))
            }
            Kind::Unary(op, a) => {
                let sign = match op {
                    UnaryOp::Minus => "-",
                    UnaryOp::Plus => "+",
                    UnaryOp::Not => "not ",
                };
                format!("({sign}{})", a.describe(scopes))
            }
            Kind::Binary(op, a, b) => format!("({} {} {})", a.describe(scopes), sign(*op), b.describe(scopes)),
            Kind::If(branches, otherwise) => {
                let branch =
                    |(c, e): &(Expr, Expr)| format!("if {} then {} else ", c.describe(scopes), e.describe(scopes));
                format!("({}{})", branches.iter().map(branch).collect::<String>(), otherwise.describe(scopes))
            }
            Kind::Range(a, step, b) => {
                let step = step.as_ref().map_or(String::new(), |step| format!("{}:", step.describe(scopes)));
                format!("({}:{step}{})", a.describe(scopes), b.describe(scopes))
            }
            Kind::Array(items) => format!("{{{}}}", all(items)),
            Kind::ArrayFor(body, iterators) => format!("{{{} for {}}}", body.describe(scopes), loops(iterators)),
            Kind::Matrix(rows) => format!("[{}]", rows.iter().map(|row| all(row)).collect::<Vec<_>>().join("; ")),
            Kind::Tuple(items) => {
                let item = |e: &Option<Expr>| e.as_ref().map_or(String::new(), |e| e.describe(scopes));
                format!("({})", items.iter().map(item).collect::<Vec<_>>().join(", "))
            }
            Kind::Field(record, name) => format!("{}.{}", record.describe(scopes), name.name),
            Kind::Colon => return ":".to_string(),
            Kind::End => "end".to_string(),
            Kind::Class(local, _) => format!("class {}", scopes.table.full_name(local.class)),
            Kind::Failed(said, _) => {
                let said: Vec<&str> = said.iter().map(|d| d.message.as_str()).collect();
                return format!("<{}>", said.join("; "));
            }
        };
        format!("{text}: {}", self.ty)
    }
}
