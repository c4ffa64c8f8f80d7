//! What a class has, with what its bases give it: components, and the attributes that types and modifications state.
//!
//! A modification where a base is extended (`extends Partial(k = 3)`) changes what the table shows.  Values stay text;
//! nothing is computed.

use hyd_syntax::print_expr;
use hyd_syntax::tree::{
    Argument, ClassBody, ClassKind, Component, Direction, Element, EnumLiteral, Expr, Modification, Variability,
};

use crate::library::{Library, elements, text_of};
use crate::lookup::DEEPEST;

/// A component of a class.
pub(crate) struct Member<'a> {
    pub(crate) component: &'a Component,
    /// The class that declares it.
    pub(crate) owner: usize,
    /// Modifications from outside with the texts they stand in, the outermost last.
    changes: Vec<(&'a str, &'a Modification)>,
}

/// What is known of a value.
#[derive(Default, Debug)]
pub(crate) struct Attributes {
    pub(crate) unit: Option<String>,
    pub(crate) min: Option<String>,
    pub(crate) max: Option<String>,
    pub(crate) nominal: Option<String>,
    pub(crate) value: Option<String>,
    pub(crate) start: Option<String>,
}

/// The groups in which components are shown.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Group {
    Connector,
    Input,
    Output,
    Parameter,
    /// A parameter that follows from others.
    Derived,
    Part,
    Variable,
}

/// The components of a class.
#[derive(Default)]
pub(crate) struct Members<'a> {
    /// Those of its bases stand where the base is extended, each base once; protected ones are left out.
    pub(crate) list: Vec<Member<'a>>,
    /// Some bases are too deep to be followed.
    pub(crate) is_cut: bool,
}

/// All components of a class.
pub(crate) fn members(library: &Library, class: usize) -> Members<'_> {
    let mut found = Members::default();
    collect(library, class, &[], &mut found, &mut vec![]);
    found
}

fn collect<'a>(
    library: &'a Library,
    class: usize,
    changes: &[(&'a str, &'a Modification)],
    found: &mut Members<'a>,
    seen: &mut Vec<usize>,
) {
    if seen.contains(&class) {
        return;
    }
    // Each level adds one set of changes.
    if changes.len() > DEEPEST {
        found.is_cut = true;
        return;
    }
    seen.push(class);
    for element in elements(&library.entries[class].class) {
        match element {
            Element::Component(component) if !component.prefixes.protected => {
                let name = &component.name.name;
                let changes = changes.iter().filter_map(|(text, change)| Some((*text, inner(change, name)?))).collect();
                found.list.push(Member { component, owner: class, changes });
            }
            Element::Extends(extends) => {
                if let Some(base) = library.find(&extends.base, class).filter(|base| *base != class) {
                    let mut all = vec![(library.text(class), &extends.modification)];
                    all.extend(changes);
                    collect(library, base, &all, found, seen);
                }
            }
            _ => {}
        }
    }
}

/// What a modification says about one element.
fn inner<'a>(modification: &'a Modification, name: &str) -> Option<&'a Modification> {
    modification.arguments.iter().find_map(|argument| match argument {
        Argument::Modify(modify) => match modify.target.parts.as_slice() {
            [target] if *target.name == *name => Some(&modify.modification),
            _ => None,
        },
        Argument::RedeclareComponent { component, .. } if *component.name.name == *name => {
            Some(&component.modification)
        }
        _ => None,
    })
}

impl Member<'_> {
    /// The class of the component, if it is one of the texts.
    pub(crate) fn class(&self, library: &Library) -> Option<usize> {
        library.find(&self.component.class, self.owner)
    }

    /// Unit, limits and value, from the type inwards out.
    pub(crate) fn attributes(&self, library: &Library) -> Attributes {
        let mut attributes = self.class(library).map(|class| of_type(library, class)).unwrap_or_default();
        attributes.take(library.text(self.owner), &self.component.modification);
        self.changes.iter().for_each(|(text, change)| attributes.take(text, change));
        attributes
    }

    /// The group it is shown in.
    pub(crate) fn group(&self, library: &Library) -> Group {
        let component = self.component;
        if component.variability <= Variability::Parameter {
            return if component.prefixes.is_final { Group::Derived } else { Group::Parameter };
        }
        let kind = self.class(library).map(|class| library.entries[class].class.kind);
        match kind {
            Some(ClassKind::Connector) => Group::Connector,
            Some(ClassKind::Model | ClassKind::Block | ClassKind::Class) => Group::Part,
            _ => match component.direction {
                Some(Direction::Input) => Group::Input,
                Some(Direction::Output) => Group::Output,
                None => Group::Variable,
            },
        }
    }
}

/// What a type states, with the types it is made from.
pub(crate) fn of_type(library: &Library, class: usize) -> Attributes {
    let mut chain = vec![class];
    while let Some(&last) = chain.last()
        && let Some(&base) = library.bases(last).first()
        && chain.len() < DEEPEST
    {
        chain.push(base);
    }
    let mut attributes = Attributes::default();
    for class in chain.into_iter().rev() {
        if let ClassBody::Short { modification, .. } = &library.entries[class].class.body {
            attributes.take(library.text(class), modification);
        }
    }
    attributes
}

/// The literals of an enumeration.
pub(crate) fn literals(library: &Library, class: usize) -> &[EnumLiteral] {
    match &library.entries[class].class.body {
        ClassBody::Enumeration(Some(literals)) => literals,
        _ => &[],
    }
}

impl Attributes {
    /// Takes over what a modification in this text states; values stay as they are written.
    fn take(&mut self, text: &str, modification: &Modification) {
        let written = |value: &Expr| {
            let span = value.span.start as usize..value.span.end as usize;
            text.get(span)
                .map_or_else(|| print_expr(value), |text| text.split_whitespace().collect::<Vec<_>>().join(" "))
        };
        for argument in &modification.arguments {
            let Argument::Modify(modify) = argument else { continue };
            let ([name], Some(value)) = (modify.target.parts.as_slice(), &modify.modification.binding) else {
                continue;
            };
            let shown = text_of(value).map_or_else(|| written(value), str::to_string);
            match &*name.name {
                "unit" => self.unit = Some(shown),
                "min" => self.min = Some(shown),
                "max" => self.max = Some(shown),
                "nominal" => self.nominal = Some(shown),
                "start" => self.start = Some(shown),
                _ => {}
            }
        }
        if let Some(value) = &modification.binding {
            self.value = Some(written(value));
        }
    }

    /// `0 … 1`, `≥ 0`, `≤ 1` or nothing.
    pub(crate) fn limits(&self) -> String {
        match (&self.min, &self.max) {
            (None, None) => String::new(),
            (Some(min), None) => format!("≥ {min}"),
            (None, Some(max)) => format!("≤ {max}"),
            (Some(min), Some(max)) => format!("{min} … {max}"),
        }
    }
}
