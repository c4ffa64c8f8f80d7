//! Subtypes: what a class must offer to stand in the place of another one.
//!
//! Every public element of the constraining class must be there with a type, sizes and prefixes that fit (Modelica 3.6,
//! sections 6.4 and 6.5); for functions the order of inputs and outputs counts, and what comes in addition needs a default
//! (section 12.4.2 and 6.6).  Types are compared by what they hold, not by their names.  Values and sizes are not evaluated here.

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassKind, Component, Direction, Element, Name, Path};

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::heir::Level;
use crate::classes::shape::{Shape, is_builtin};

/// Deepest nesting that is compared.
const MAX_DEPTH: usize = 6;

/// Why a class does not fit: a sentence and the place in the class that asks for it.
struct Misfit {
    message: String,
    asked: Option<Span>,
    offered: Option<Span>,
}

/// The type of an element.
#[derive(Clone, PartialEq)]
enum Type {
    Builtin(Name),
    Class(ClassId),
    Unknown,
}

impl ClassTable<'_> {
    /// Class `new`, used at `span`, must offer what `wanted` offers.
    pub(crate) fn check_offers(&mut self, new: ClassId, wanted: ClassId, span: Span) -> Result<(), Reported> {
        let Some(misfit) = self.misfit(new, wanted, MAX_DEPTH) else { return Ok(()) };
        let mut diagnostic = Diagnostic::error(Code::Redeclaration, misfit.message).at(span, "redeclared here");
        if let Some(asked) = misfit.asked {
            diagnostic = diagnostic.with(asked, "asked for here");
        }
        if let Some(offered) = misfit.offered {
            diagnostic = diagnostic.with(offered, "offered here");
        }
        if let Some(base) = self.common_base(new, wanted) {
            diagnostic = diagnostic.help(format!(
                "both extend `{base}`: if that is all that is needed, `constrainedby {base}` behind the replaceable declaration says so"
            ));
        }
        self.report(diagnostic);
        Err(Reported)
    }

    /// The first class that both extend.
    fn common_base(&mut self, new: ClassId, wanted: ClassId) -> Option<String> {
        let (a, b) = (self.shape(new).ok()?, self.shape(wanted).ok()?);
        let bases = b.frames.iter().map(|frame| frame.class).filter(|&class| class != wanted && class != new);
        let common = bases.into_iter().find(|class| a.frames.iter().any(|frame| frame.class == *class))?;
        Some(self.full_name(common))
    }

    /// Why class `new` cannot stand where `wanted` is expected; `None` if it can.
    pub(crate) fn why_not(&mut self, new: ClassId, wanted: ClassId) -> Option<String> {
        self.misfit(new, wanted, MAX_DEPTH).map(|misfit| misfit.message)
    }

    fn misfit(&mut self, new: ClassId, wanted: ClassId, depth: usize) -> Option<Misfit> {
        if new == wanted || depth == 0 {
            return None;
        }
        let (a, b) = (self.shape(new).ok()?, self.shape(wanted).ok()?);
        let base = |shape: &Shape, class: ClassId| shape.frames.iter().any(|f| f.class == class);
        if base(&a, wanted) {
            return None;
        }
        let (name, other) = (self.full_name(new), self.full_name(wanted));
        let kinds = (self.class(new).def.kind, self.class(wanted).def.kind);
        if let Some(message) = unlike_kinds(kinds, &name, &other) {
            return Some(Misfit { message, asked: Some(self.class(wanted).def.name.span), offered: None });
        }
        if a.builtin.is_some() || b.builtin.is_some() {
            let text = |shape: &Shape| shape.builtin.as_ref().map_or("a class", |b| b.as_ref()).to_string();
            let (x, y) = (text(&a), text(&b));
            let message = format!("`{name}` is {x}, but `{other}` is {y}");
            return (x != y).then_some(Misfit {
                message,
                asked: Some(self.class(wanted).def.name.span),
                offered: None,
            });
        }
        for element in &b.elements {
            let Some(asked) = self.element_of(&b, element.frame, element.position) else { continue };
            let (protected, asked_at) = prefix(&asked);
            if protected || b.frames[element.frame as usize].protected {
                continue;
            }
            let offered = a.by_name.get(&element.name).map(|&k| &a.elements[k as usize]);
            let found = offered.and_then(|o| Some((self.element_of(&a, o.frame, o.position)?, o.frame)));
            let found = found.filter(|(e, frame)| !prefix(e).0 && !a.frames[*frame as usize].protected);
            let Some((found, frame)) = found else {
                let missing = if matches!(asked, Element::Component(_)) { "element" } else { "class" };
                if missing == "class" && self.member_class(new, &element.name).is_some() {
                    continue;
                }
                let message = format!("`{name}` has no {missing} `{}`, which `{other}` has", element.name);
                return Some(Misfit { message, asked: asked_at, offered: None });
            };
            let offered_at = prefix(&found).1;
            let why = match (&found, &asked) {
                (Element::Component(x), Element::Component(y)) => {
                    self.component_misfit((x, &a, frame, new), (y, &b, element.frame, wanted), depth)
                }
                (Element::Class(_), Element::Class(_)) => None,
                (Element::Component(_), _) => Some("is a component, not a class".to_string()),
                _ => Some("is a class, not a component".to_string()),
            };
            if let Some(why) = why {
                let message = format!("`{}` of `{name}` {why}, as `{other}` asks for", element.name);
                return Some(Misfit { message, asked: asked_at, offered: offered_at });
            }
        }
        (kinds.1 == ClassKind::Function).then(|| self.signature_misfit(&a, &b, &name, &other)).flatten()
    }

    fn element_of(&self, shape: &Shape, frame: u32, position: u32) -> Option<Element> {
        elements(&self.class(shape.frames[frame as usize].class).def).get(position as usize).cloned()
    }

    /// Why a component does not fit another one, as `is ..., not ...`.
    fn component_misfit(
        &mut self,
        new: (&Component, &Shape, u32, ClassId),
        wanted: (&Component, &Shape, u32, ClassId),
        depth: usize,
    ) -> Option<String> {
        let (x, y) = (new.0, wanted.0);
        if x.flow != y.flow {
            let text = |flow: bool| if flow { "a flow" } else { "a potential" };
            return Some(format!("is {}, not {}", text(x.flow), text(y.flow)));
        }
        if x.direction != y.direction {
            return Some(format!("is {}, not {}", direction(x.direction), direction(y.direction)));
        }
        if x.variability > y.variability {
            use hyd_syntax::tree::Variability::{Constant, Discrete, Parameter};
            let asked = match y.variability {
                Constant => "a constant",
                Parameter => "a parameter",
                Discrete => "discrete",
                hyd_syntax::tree::Variability::Continuous => "a variable",
            };
            return Some(format!("is not {asked}"));
        }
        let types = (
            self.type_in(Level { members: new.3, text: new.1.frames[new.2 as usize].class }, &x.class),
            self.type_in(Level { members: wanted.3, text: wanted.1.frames[wanted.2 as usize].class }, &y.class),
        );
        let plain = matches!(types, (Type::Builtin(_), Type::Builtin(_)));
        if plain && x.dims.len() != y.dims.len() {
            return Some(format!("has {} dimensions, not {}", x.dims.len(), y.dims.len()));
        }
        match types {
            (Type::Builtin(x), Type::Builtin(y)) => (x != y).then(|| format!("is {x}, not {y}")),
            // What is chosen by a class of the model may be chosen differently there.
            (Type::Class(_), Type::Class(_)) if local(new.1, x) || local(wanted.1, y) => None,
            (Type::Class(c), Type::Class(d)) => {
                let misfit = self.misfit(c, d, depth - 1)?;
                Some(format!("does not fit ({})", misfit.message))
            }
            (Type::Class(c), Type::Builtin(b)) => Some(format!("is `{}`, not {b}", self.full_name(c))),
            (Type::Builtin(b), Type::Class(c)) => Some(format!("is {b}, not `{}`", self.full_name(c))),
            _ => None,
        }
    }

    /// The type a declaration names; derived types are what they are derived from.
    fn type_in(&mut self, level: Level, path: &Path) -> Type {
        if path.parts.len() == 1 && is_builtin(&path.parts[0].name) {
            return Type::Builtin(path.parts[0].name.clone());
        }
        let found = self.quietly(|table| table.find_class_static(level.text, path, false));
        let Ok(class) = found else { return Type::Unknown };
        match self.shape(class) {
            Ok(shape) => match &shape.builtin {
                Some(builtin) => Type::Builtin(builtin.clone()),
                None => Type::Class(class),
            },
            Err(Reported) => Type::Unknown,
        }
    }

    /// Inputs and outputs of functions count by their order.
    fn signature_misfit(&mut self, new: &Shape, wanted: &Shape, name: &str, other: &str) -> Option<Misfit> {
        for (kind, text) in [(Direction::Input, "input"), (Direction::Output, "output")] {
            let list = |table: &Self, shape: &Shape| -> Vec<Component> {
                let all = shape.elements.iter().filter_map(|e| table.element_of(shape, e.frame, e.position));
                all.filter_map(|e| match e {
                    Element::Component(c) if c.direction == Some(kind) => Some(c),
                    _ => None,
                })
                .collect()
            };
            let (x, y) = (list(self, new), list(self, wanted));
            for (k, asked) in y.iter().enumerate() {
                if let Some(offered) = x.get(k).filter(|c| c.name.name != asked.name.name) {
                    let message = format!(
                        "{text} {} of `{name}` is `{}`, but that of `{other}` is `{}`",
                        k + 1,
                        offered.name.name,
                        asked.name.name
                    );
                    let (asked, offered) = (Some(asked.name.span), Some(offered.name.span));
                    return Some(Misfit { message, asked, offered });
                }
            }
            let given = |name: &str| {
                let mut modifications = new.frames.iter().flat_map(|frame| &frame.modifications);
                modifications.any(|(_, tree)| {
                    tree.children.iter().any(|(child, said)| child.as_ref() == name && said.binding.is_some())
                })
            };
            let open =
                |c: &&Component| kind == Direction::Input && c.modification.binding.is_none() && !given(&c.name.name);
            if let Some(extra) = x.iter().skip(y.len()).find(open) {
                let message = format!(
                    "the input `{}` of `{name}` has no default, and `{other}` has no such input",
                    extra.name.name
                );
                return Some(Misfit { message, asked: None, offered: Some(extra.name.span) });
            }
        }
        None
    }
}

/// The type is named by way of a class that is itself an element beside it.
fn local(shape: &Shape, component: &Component) -> bool {
    let first = &component.class.parts[0].name;
    shape.by_name.get(first).is_some_and(|&k| !shape.elements[k as usize].component)
}

fn direction(direction: Option<Direction>) -> &'static str {
    match direction {
        Some(Direction::Input) => "an input",
        Some(Direction::Output) => "an output",
        None => "neither input nor output",
    }
}

fn prefix(element: &Element) -> (bool, Option<Span>) {
    match element {
        Element::Component(c) => (c.prefixes.protected, Some(c.name.span)),
        Element::Class(c) => (c.prefixes.protected, Some(c.class.name.span)),
        _ => (true, None),
    }
}

/// A function, a package, a record and a connector take the place of their own kind only.
fn unlike_kinds((new, wanted): (ClassKind, ClassKind), name: &str, other: &str) -> Option<String> {
    let special = |kind| matches!(kind, ClassKind::Function | ClassKind::Package | ClassKind::Connector);
    if new == wanted || !special(new) && !special(wanted) {
        return None;
    }
    Some(format!("`{name}` is a {}, but `{other}` is a {}", new.keyword(), wanted.keyword()))
}
