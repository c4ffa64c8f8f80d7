//! What there is to say of one class, as data: its words, what it inherits, its components with units and defaults, the classes within it.

use hyd_syntax::tree::{ClassBody, Element};
use hyd_syntax::{print_expr, print_path};

use crate::library::{Library, annotated, text_of};
use crate::members::{Group, literals, members, of_type};
use crate::sections::kind;

/// A class.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Described {
    /// Full name.
    pub name: String,
    /// `model`, `partial connector`.
    pub kind: String,
    /// The string behind its name.
    pub description: String,
    /// Its documentation, with the markup that it is written in.
    pub info: String,
    /// Full names of its bases, or their names as written where they are not known.
    pub bases: Vec<String>,
    /// Its unit, if it is a type with one.
    pub unit: String,
    /// The literals of an enumeration, with what they mean.
    pub literals: Vec<(String, String)>,
    /// Components by what they are (`connectors`, `inputs`, `outputs`, `parameters`, `derived`, `parts`, `variables`); groups without any are left
    /// out, those of bases stand among its own.
    pub groups: Vec<(&'static str, Vec<Item>)>,
    /// The classes within it.
    pub classes: Vec<Inside>,
}

/// A component of a class; what is not known is empty.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Item {
    /// With its dimensions.
    pub name: String,
    /// Its class, by full name where that is known.
    pub class: String,
    /// The string behind its declaration.
    pub description: String,
    /// Its unit.
    pub unit: String,
    /// Its default, or the value that it starts from.
    pub value: String,
    /// Least value.
    pub min: String,
    /// Largest value.
    pub max: String,
    /// Connections add it up.
    pub is_flow: bool,
}

/// A class within another one.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Inside {
    /// Full name.
    pub name: String,
    /// `model`, `package`.
    pub kind: String,
    /// The string behind its name.
    pub description: String,
}

const GROUPS: [(Group, &str); 7] = [
    (Group::Connector, "connectors"),
    (Group::Input, "inputs"),
    (Group::Output, "outputs"),
    (Group::Parameter, "parameters"),
    (Group::Derived, "derived"),
    (Group::Part, "parts"),
    (Group::Variable, "variables"),
];

impl Library {
    /// Full names of all classes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.by_name.keys().map(String::as_str)
    }

    /// The classes that are in no other.
    pub fn outermost(&self) -> Vec<Inside> {
        (0..self.entries.len()).filter(|&k| self.entries[k].parent.is_none()).map(|k| self.inside(k)).collect()
    }

    /// What there is to say of the class of this name.
    pub fn describe(&self, name: &str) -> Option<Described> {
        let &own = self.by_name.get(name)?;
        let class = &self.entries[own].class;
        let info = annotated(class.annotation.as_ref(), &["Documentation", "info"]).and_then(text_of);
        let bases = match &class.body {
            ClassBody::Long { elements, .. } => {
                let extended = elements.iter().filter_map(|element| match element {
                    Element::Extends(extends) => Some(&extends.base),
                    _ => None,
                });
                extended.map(|base| self.full_name(self.find(base, own), || print_path(base))).collect()
            }
            ClassBody::Short { base, .. } => {
                let outer = self.entries[own].parent.unwrap_or(own);
                vec![self.full_name(self.find(base, outer), || print_path(base))]
            }
            _ => Vec::new(),
        };
        let all = members(self, own).list;
        let group = |(group, title): (Group, &'static str)| {
            let items = all.iter().filter(|member| member.group(self) == group).map(|member| {
                let component = member.component;
                let attributes = member.attributes(self);
                let dims: Vec<String> = component.dims.iter().map(print_expr).collect();
                let dims = if dims.is_empty() { String::new() } else { format!("[{}]", dims.join(", ")) };
                Item {
                    name: format!("{}{dims}", component.name.name),
                    class: self.full_name(member.class(self), || print_path(&component.class)),
                    description: component.description.as_deref().unwrap_or_default().to_string(),
                    unit: attributes.unit.unwrap_or_default(),
                    value: attributes.value.or(attributes.start).unwrap_or_default(),
                    min: attributes.min.unwrap_or_default(),
                    max: attributes.max.unwrap_or_default(),
                    is_flow: component.flow,
                }
            });
            (title, items.collect::<Vec<Item>>())
        };
        let literal = |own: &hyd_syntax::tree::EnumLiteral| {
            (own.name.name.to_string(), own.description.as_deref().unwrap_or_default().to_string())
        };
        Some(Described {
            name: name.to_string(),
            kind: kind(self, own),
            description: class.description.as_deref().unwrap_or_default().to_string(),
            info: info.unwrap_or_default().to_string(),
            bases,
            unit: of_type(self, own).unit.unwrap_or_default(),
            literals: literals(self, own).iter().map(literal).collect(),
            groups: GROUPS.into_iter().map(group).filter(|(_, items)| !items.is_empty()).collect(),
            classes: self.within(own).into_iter().map(|child| self.inside(child)).collect(),
        })
    }

    fn inside(&self, class: usize) -> Inside {
        let entry = &self.entries[class];
        Inside {
            name: entry.name.clone(),
            kind: kind(self, class),
            description: entry.class.description.as_deref().unwrap_or_default().to_string(),
        }
    }

    fn full_name(&self, class: Option<usize>, written: impl FnOnce() -> String) -> String {
        class.map_or_else(written, |class| self.entries[class].name.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;

    #[test]
    fn a_class_is_told_with_what_its_bases_give_it() {
        let text = "package P \"parts\"\n  type Mass = Real(unit = \"kg\", min = 0);\n  connector Flange\n    Real s;\n    flow Real f;\n  \
                    end Flange;\n  partial model Base\n    Flange a \"left\";\n    parameter Mass m = 1 \"inertia\";\n  end Base;\n  \
                    model Block \"slides\"\n    extends Base(m = 2);\n    Real x[3](each unit = \"m\");\n    \
                    annotation(Documentation(info = \"<p>Hm.</p>\"));\n  end Block;\nend P;\n";
        let source = Source { name: "P.hyd".into(), text: text.into(), shown: true, order: Vec::new() };
        let library = Library::new(vec![source]);
        let block = library.describe("P.Block").unwrap_or_default();
        assert_eq!(
            (block.kind.as_str(), block.description.as_str(), block.info.as_str()),
            ("model", "slides", "<p>Hm.</p>")
        );
        assert_eq!(block.bases, ["P.Base"]);
        let titles: Vec<&str> = block.groups.iter().map(|(title, _)| *title).collect();
        assert_eq!(titles, ["connectors", "parameters", "variables"]);
        let m = &block.groups[1].1[0];
        assert_eq!((m.name.as_str(), m.class.as_str(), m.unit.as_str()), ("m", "P.Mass", "kg"));
        assert_eq!((m.value.as_str(), m.min.as_str(), m.description.as_str()), ("2", "0", "inertia"));
        assert_eq!(block.groups[2].1[0].name, "x[3]");
        let flange = library.describe("P.Flange").unwrap_or_default();
        assert!(flange.groups[0].1.iter().any(|item| item.name == "f" && item.is_flow));
        assert_eq!(library.outermost().len(), 1);
        assert_eq!(library.describe("P").unwrap_or_default().classes.len(), 4);
        assert_eq!(library.describe("P.Nothing"), None);
    }
}
