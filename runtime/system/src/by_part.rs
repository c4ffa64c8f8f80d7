//! Values set for arrays of components whose elements are variables of their own.
//!
//! Where the elements of an array differ in structure, `c[1].R` and `c[2].R` are two variables, and none is called `c.R`.  A value for
//! `c.R` is one for each of them, a list has their order.

use crate::given::{Elements, Given, wrong_sizes};
use crate::tables::NamePattern;

/// The assignments with each one for such an array replaced by one for every element; the others stay as they are, those of
/// names that the model does not have among them.
///
/// # Errors
/// A list that does not have the size of the array, as a sentence.
pub fn by_part<'n>(
    set: &[(String, String)],
    names: impl Iterator<Item = &'n NamePattern> + Clone,
) -> Result<Vec<(String, String)>, String> {
    let mut all = Vec::with_capacity(set.len());
    for (name, text) in set {
        if names.clone().any(|pattern| Elements::of(pattern, name).is_some()) {
            all.push((name.clone(), text.clone()));
            continue;
        }
        let parts = names.clone().map(|pattern| pattern.parts.iter().map(|(text, _)| &**text).collect::<String>());
        let parts: Vec<(String, Vec<usize>)> = parts
            .filter_map(|part| {
                let (bare, subscripts) = without_subscripts(&part)?;
                (bare == *name).then_some((part, subscripts))
            })
            .collect();
        if parts.is_empty() {
            all.push((name.clone(), text.clone()));
            continue;
        }
        let wrong = |why: String| format!("`{name}` cannot be set to `{text}`: {why}");
        let value = Given::read(text).map_err(wrong)?;
        let rank = parts[0].1.len();
        let sizes: Vec<usize> =
            (0..rank).map(|d| parts.iter().filter_map(|(_, at)| at.get(d)).max().copied().unwrap_or(0)).collect();
        for (part, at) in parts {
            let element = element(&value, &at, &sizes).map_err(wrong)?;
            all.push((part, element.to_string()));
        }
    }
    Ok(all)
}

/// The value of one element: a single value is that of all of them.
fn element<'g, 't>(value: &'g Given<'t>, at: &[usize], sizes: &[usize]) -> Result<&'g Given<'t>, String> {
    match (value, at, sizes) {
        (Given::List(items), [k, inner @ ..], [size, rest @ ..]) => match items.get(*k - 1) {
            Some(item) if items.len() == *size => element(item, inner, rest),
            _ => Err(wrong_sizes(&[*size], &[items.len()])),
        },
        _ => Ok(value),
    }
}

/// A name without the subscripts in it, and these, counted from 1; none if there are none.
fn without_subscripts(name: &str) -> Option<(String, Vec<usize>)> {
    let (mut bare, mut subscripts, mut rest) = (String::new(), Vec::new(), name);
    while let Some((before, after)) = rest.split_once('[') {
        let (inside, behind) = after.split_once(']')?;
        bare.push_str(before);
        for subscript in inside.split(',') {
            subscripts.push(subscript.parse().ok().filter(|&k| k > 0)?);
        }
        rest = behind;
    }
    bare.push_str(rest);
    (!subscripts.is_empty()).then_some((bare, subscripts))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_for_the_array_is_one_for_each_element() {
        let scalar = |name: &str| NamePattern { parts: vec![(name.into(), Vec::new())], derivative: false };
        let array = NamePattern { parts: vec![("c[2].v".into(), vec![3])], derivative: false };
        let names = [scalar("c[1].R"), scalar("c[2].R"), array, scalar("R")];
        let of = |name: &str, text: &str| by_part(&[(name.into(), text.into())], names.iter());
        let pairs = |list: &[(&str, &str)]| Ok(list.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect());
        assert_eq!(of("c.R", "{4, 5}"), pairs(&[("c[1].R", "4"), ("c[2].R", "5")]));
        assert_eq!(of("c.R", "4"), pairs(&[("c[1].R", "4"), ("c[2].R", "4")]));
        assert_eq!(of("c.v", "{1, {1, 2, 3}}"), pairs(&[("c[2].v", "{1, 2, 3}")]));
        for kept in ["R", "c[2].R", "c[2].v[1]", "unknown"] {
            assert_eq!(of(kept, "{4}"), pairs(&[(kept, "{4}")]), "{kept}");
        }
        let wrong = of("c.R", "{1, 2, 3}");
        assert_eq!(wrong, Err("`c.R` cannot be set to `{1, 2, 3}`: it has 2 elements, not 3".to_string()));
        assert!(of("c.R", "{1").is_err());
    }
}
