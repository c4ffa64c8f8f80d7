//! Values set from outside (`--set a.b=1.2`) for what is needed at translation.

use hyd_system::ValueKind;
use hyd_system::given::{Given, number, string, wrong_sizes};

use crate::instantiation::instance::ScalarType;
use crate::values::value::Value;

/// Reads a value for a variable of this type and its own sizes, the sizes of the components around it in front (`all`): one for all
/// elements, or a list.
///
/// # Errors
/// Why it is not a value of this type and these sizes.
pub(crate) fn read_value(scalar: &ScalarType, text: &str, own: &[usize], all: &[usize]) -> Result<Value, String> {
    let given = Given::read(text)?;
    let sizes = given.sizes()?;
    if sizes.is_empty() {
        let Given::Leaf(leaf) = given else { return Err(wrong_sizes(all, &sizes)) };
        let value = value(scalar, leaf)?;
        return Ok(Value::filled(value, own));
    }
    if sizes != own && sizes != all {
        return Err(wrong_sizes(all, &sizes));
    }
    if sizes.contains(&0) {
        return Ok(Value::filled(Value::Integer(0), &sizes));
    }
    nested(scalar, &given)
}

fn nested(scalar: &ScalarType, given: &Given<'_>) -> Result<Value, String> {
    match given {
        Given::Leaf(leaf) => value(scalar, leaf),
        Given::List(items) => items.iter().map(|item| nested(scalar, item)).collect::<Result<_, _>>().map(Value::array),
    }
}

fn value(scalar: &ScalarType, leaf: &str) -> Result<Value, String> {
    Ok(match scalar {
        ScalarType::Real => {
            let real = number(&ValueKind::Real, leaf)?;
            leaf.parse::<i64>().map_or(Value::Real(real), Value::Integer)
        }
        ScalarType::Integer => Value::Integer(number(&ValueKind::Integer, leaf)? as i64),
        ScalarType::Boolean => Value::Boolean(number(&ValueKind::Boolean, leaf)? != 0.0),
        ScalarType::Text => Value::Text(string(leaf).into()),
        ScalarType::Clock => return Err("a clock cannot be set".to_string()),
        ScalarType::Object => return Err("an external object cannot be set".to_string()),
        ScalarType::Enumeration(kind) => {
            let literals =
                ValueKind::Enumeration(kind.literals.iter().map(|literal| literal.as_ref().into()).collect());
            Value::Enumeration(kind.clone(), number(&literals, leaf)? as u32)
        }
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::values::value::EnumType;

    #[test]
    fn values_have_the_type_and_the_sizes() {
        let real = |text: &str, own: &[usize], all: &[usize]| read_value(&ScalarType::Real, text, own, all);
        assert_eq!(real(" 1e-3 ", &[], &[]), Ok(Value::Real(1e-3)));
        assert_eq!(real("-4", &[], &[]), Ok(Value::Integer(-4)));
        let row = |a, b| Value::array(vec![Value::Integer(a), Value::Integer(b)]);
        assert_eq!(real("{{1,2}, {3,4}}", &[2, 2], &[2, 2]), Ok(Value::array(vec![row(1, 2), row(3, 4)])));
        assert_eq!(real("5", &[2], &[2]), Ok(row(5, 5)));
        // An array of components: the same for all of them, or each its own.
        assert_eq!(real("{1, 2}", &[2], &[3, 2]), Ok(row(1, 2)));
        assert_eq!(real("5", &[], &[2]), Ok(Value::Integer(5)));
        assert_eq!(real("{1, 2}", &[], &[2]), Ok(row(1, 2)));
        assert_eq!(real("{1}", &[], &[]), Err("it is not an array".to_string()));
        assert_eq!(real("{1, 2}", &[3], &[3]), Err("it has 3 elements, not 2".to_string()));
    }

    #[test]
    fn literals_and_strings_need_no_more_than_their_name() {
        let kind =
            Arc::new(EnumType { name: "P.E".into(), literals: vec!["a".into(), "b".into()], descriptions: Vec::new() });
        let scalar = ScalarType::Enumeration(kind.clone());
        for text in ["b", "E.b", "P.E.b"] {
            assert_eq!(read_value(&scalar, text, &[], &[]), Ok(Value::Enumeration(kind.clone(), 2)), "{text}");
        }
        assert_eq!(read_value(&scalar, "c", &[], &[]), Err("it is one of a, b".to_string()));
        for text in ["oil.txt", "\"oil.txt\""] {
            assert_eq!(read_value(&ScalarType::Text, text, &[], &[]), Ok(Value::Text("oil.txt".into())));
        }
    }
}
