//! Type definitions: what variables with `declaredType` take over.

use std::collections::HashMap;
use std::sync::Arc;

use crate::description::Version;
use crate::fault::Fault;
use crate::xml::Element;

/// Literals of an enumeration with their values.
type Literals = Arc<[(Arc<str>, i64)]>;

/// Attributes that a type hands on, as they are written, and literals of an enumeration.
#[derive(Clone, Default)]
pub(crate) struct Type<'a> {
    pub(crate) attributes: HashMap<&'a str, &'a str>,
    pub(crate) literals: Option<Literals>,
}

/// Types by name.
pub(crate) type Types<'a> = HashMap<&'a str, Type<'a>>;

const HANDED_ON: [&str; 6] = ["unit", "displayUnit", "min", "max", "nominal", "quantity"];

/// Reads `TypeDefinitions`.
pub(crate) fn read<'a>(root: Element<'a>, version: Version) -> Result<Types<'a>, Fault> {
    let mut types = Types::new();
    for element in root.child("TypeDefinitions").into_iter().flat_map(Element::children) {
        let name = element.required("name")?;
        // In 2.0 the type stands within `SimpleType`.
        let inner = match version {
            Version::Two => match element.children().next() {
                Some(inner) => inner,
                None => continue,
            },
            Version::Three => element,
        };
        let attributes = HANDED_ON.iter().filter_map(|&name| Some((name, inner.attribute(name)?))).collect();
        let is_enumeration = inner.name().starts_with("Enumeration");
        let literals = if is_enumeration { Some(literals(inner)?) } else { None };
        types.insert(name, Type { attributes, literals });
    }
    Ok(types)
}

fn literals(element: Element<'_>) -> Result<Literals, Fault> {
    let items = element.children().filter(|item| item.name() == "Item");
    let one = |item: Element<'_>| {
        let value = item.number("value")?.ok_or_else(|| item.fault("`Item` has no `value`"))?;
        Ok((item.required("name")?.into(), value))
    };
    items.map(one).collect()
}
