//! What a name of a text means, found from classes alone, without any instance: for tools that ask about a place in a text that may be
//! wrong elsewhere.
//!
//! The rules are those of `class_lookup` and of lookup in instances (Modelica 3.6, sections 5.3 and 7.1), as far as declarations tell:
//! redeclarations of the component in front of a dot count, values and conditions do not.  Nothing here gives messages.

use std::sync::Arc;

use hyd_source::Span;
use hyd_syntax::names::{ClassPart, Modifier, Names, Place, Purpose, ReferencePart};
use hyd_syntax::tree::{Argument, ClassBody, Component, Element, Expr, Ident, ImportKind, Modification, Name, Path};

use crate::builtins::Builtin;
use crate::classes::class::{ClassId, ClassTable, elements, imports};
use crate::classes::modifier::{AstMod, Redeclare};
use crate::classes::shape::is_builtin;

/// Most steps of one chain of short definitions, and of classes inside one another.
const DEEPEST: usize = 100;

/// What a name means.
#[derive(Clone, Debug)]
pub enum Meaning {
    /// A class.
    Class(ClassId),
    /// A component of a class.
    Component(Member),
    /// A literal of an enumeration.
    Literal {
        /// The enumeration.
        class: ClassId,
        /// Which literal, from 0.
        position: usize,
    },
    /// A loop variable, by its declaration.
    Iterator(Span),
    /// A predefined type.
    Type(Name),
    /// An attribute of a predefined type.
    Attribute {
        /// Its name.
        name: Name,
        /// The type.
        of: Name,
    },
    /// A function or operator of the language.
    Builtin(Builtin),
    /// `time`
    Time,
}

/// A component with what is said of it on the way to it.
#[derive(Clone, Debug)]
pub struct Member {
    /// The class whose text declares it.
    pub owner: ClassId,
    /// The class that it is looked at in: `owner`, or one that inherits from it.
    pub of: ClassId,
    /// The declaration.
    pub component: Arc<Component>,
    /// What is said of it, outermost first, each with the class whose text it stands in: by modifications, by the redeclaration that
    /// takes its place, and by its declaration as far as that stays in force then.
    pub said: Vec<(Arc<AstMod>, ClassId)>,
    /// The same of all elements beside it: classes may be redeclared there.
    pub around: Vec<(Arc<AstMod>, ClassId)>,
}

impl Member {
    /// The declaration that takes the place of its own, with the class whose text it stands in.
    pub fn redeclared(&self) -> Option<(Arc<Component>, ClassId)> {
        self.said.iter().find_map(|(tree, by)| match &tree.redeclare {
            Some(Redeclare::Component(component)) => Some((component.clone(), *by)),
            _ => None,
        })
    }
}

/// What a component is made of.
#[derive(Clone, Debug)]
pub struct Kind {
    /// Its class.
    pub class: KindClass,
    /// What is said of what is inside, outermost first.
    pub said: Vec<(Arc<AstMod>, ClassId)>,
}

/// A class or a predefined type.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum KindClass {
    /// A class.
    Class(ClassId),
    /// A predefined type.
    Builtin(Name),
}

/// An element that can be named somewhere.
#[derive(Clone, Debug)]
pub enum Visible {
    /// A component.
    Component(Member),
    /// A class.
    Class(Name, ClassId),
}

/// A value that is given to an attribute, or to a variable itself.
#[derive(Clone, Debug)]
pub struct Given {
    /// The expression.
    pub value: Arc<Expr>,
    /// The class whose text it stands in.
    pub by: ClassId,
}

impl ClassTable<'_> {
    /// The classes of a text, in the order of [`Names::classes`]; `top` are those that [`ClassTable::add_main`] gave.
    pub fn ids_of(&mut self, names: &Names, top: &[ClassId]) -> Vec<Option<ClassId>> {
        let mut ids: Vec<Option<ClassId>> = Vec::new();
        let mut tops = top.iter();
        for place in &names.classes {
            let id = match place.parent {
                None => tops.next().copied(),
                Some(parent) => ids.get(parent).copied().flatten().and_then(|parent| {
                    let found = self.quietly(|table| table.child(parent, &place.def.name.name))?;
                    // Of two classes with one name the first is found.
                    (self.class(found).def.name.span == place.def.name.span).then_some(found)
                }),
            };
            ids.push(id);
        }
        ids
    }

    /// What the name at a place means; `ids` as of [`ClassTable::ids_of`].
    pub fn meaning(&mut self, place: &Place, ids: &[Option<ClassId>]) -> Option<Meaning> {
        self.quietly(|table| table.meaning_at(place, ids))
    }

    fn meaning_at(&mut self, place: &Place, ids: &[Option<ClassId>]) -> Option<Meaning> {
        let class = place.class.and_then(|at| ids.get(at).copied().flatten());
        match &place.purpose {
            Purpose::DeclaresClass | Purpose::EndsClass => class.map(Meaning::Class),
            Purpose::DeclaresComponent(component) => {
                let owner = class?;
                Some(Meaning::Component(member_of((owner, owner), component, None, &[])))
            }
            Purpose::DeclaresLiteral => self.literal_of(class?, &place.ident.name),
            Purpose::DeclaresIterator => Some(Meaning::Iterator(place.ident.span)),
            Purpose::Class(part) => self.class_part(part, class),
            Purpose::Reference(part) => self.reference_part(part, class?),
            Purpose::Modifier(modifier) => self.modifier_part(modifier, class?),
            Purpose::Argument { function } => {
                let at = function.parts.len() - 1;
                let called = self.reference_part(&ReferencePart { at, ..function.clone() }, class?)?;
                let Meaning::Class(function) = called else { return None };
                self.member(function, &place.ident.name, &[])
            }
        }
    }

    /// The class that the first parts of a dotted name mean.
    fn class_part(&mut self, part: &ClassPart, from: Option<ClassId>) -> Option<Meaning> {
        let names = part.path.parts.get(..=part.at)?;
        if names.len() == 1 && !part.import && (is_builtin(&names[0].name) && part.path.parts.len() == 1) {
            return Some(Meaning::Type(names[0].name.clone()));
        }
        let first = match (part.import || part.path.global, from) {
            (false, Some(from)) => self.find_first(from, &names[0].name, part.base),
            _ => self.top(&names[0].name),
        };
        let found = names[1..].iter().try_fold(first?, |class, name| self.member_class(class, &name.name));
        match found {
            Some(class) => Some(Meaning::Class(class)),
            // An import of a constant.
            None if part.import && names.len() > 1 => {
                let package = self.absolute(&names[..names.len() - 1])?;
                self.member(package, &names[names.len() - 1].name, &[])
            }
            None => None,
        }
    }

    /// What the first parts of a reference mean.
    fn reference_part(&mut self, part: &ReferencePart, from: ClassId) -> Option<Meaning> {
        if let Some(iterator) = part.iterator.filter(|_| part.at == 0) {
            return Some(Meaning::Iterator(iterator));
        }
        let names = part.parts.get(..=part.at)?;
        let mut meaning = match part.global {
            true => self.top(&names[0].name).map(Meaning::Class)?,
            false => self.named(from, &names[0].name)?,
        };
        for name in &names[1..] {
            meaning = self.inside(&meaning, &name.name)?;
        }
        Some(meaning)
    }

    /// What a simple name means inside a class: an element, a class or constant around it, a name of the language.
    pub fn named(&mut self, from: ClassId, name: &Name) -> Option<Meaning> {
        if let Some(Meaning::Component(member)) = self.member(from, name, &[]) {
            return Some(Meaning::Component(member));
        }
        if &**name == "time" {
            return Some(Meaning::Time);
        }
        if let Some(class) = self.find_first(from, name, false) {
            return Some(Meaning::Class(class));
        }
        let mut around = Some(from);
        while let Some(class) = around {
            if let Some(found) = self.imported_constant_of(class, name) {
                return Some(found);
            }
            around = self.class(class).parent.filter(|_| !self.class(class).def.encapsulated);
            if let Some(found) = around.and_then(|around| self.member(around, name, &[])) {
                return Some(found);
            }
        }
        if is_builtin(name) {
            return Some(Meaning::Type(name.clone()));
        }
        Builtin::from_name(name).map(Meaning::Builtin)
    }

    fn imported_constant_of(&mut self, class: ClassId, name: &Name) -> Option<Meaning> {
        let def = self.class(class).def.clone();
        for import in imports(&def) {
            let parts = &import.path.parts;
            let (last, before) = parts.split_last()?;
            let (package, element): (&[Ident], &Name) = match &import.what {
                ImportKind::Qualified if last.name == *name => (before, name),
                ImportKind::Renamed(alias) if alias.name == *name => (before, &last.name),
                ImportKind::Several(names) if names.iter().any(|one| one.name == *name) => (parts, name),
                ImportKind::All => (parts, name),
                _ => continue,
            };
            if !package.is_empty()
                && let Some(package) = self.absolute(package)
                && let Some(found) = self.member(package, element, &[])
            {
                return Some(found);
            }
        }
        None
    }

    /// What a name means behind the dot after something.
    pub fn inside(&mut self, what: &Meaning, name: &Name) -> Option<Meaning> {
        match what {
            Meaning::Component(member) => {
                let kind = self.kind_of(member)?;
                self.inside_kind(&kind, name)
            }
            Meaning::Class(class) => match self.member_class(*class, name) {
                Some(inner) => Some(Meaning::Class(inner)),
                None => self.member(*class, name, &[]).or_else(|| self.literal_of(*class, name)),
            },
            _ => None,
        }
    }

    fn inside_kind(&mut self, kind: &Kind, name: &Name) -> Option<Meaning> {
        match &kind.class {
            KindClass::Class(class) => {
                let found = self.member(*class, name, &kind.said);
                found.or_else(|| self.member_class(*class, name).map(Meaning::Class)).or_else(|| {
                    let of = self.builtin_of(*class)?;
                    Some(Meaning::Attribute { name: name.clone(), of })
                })
            }
            KindClass::Builtin(of) => Some(Meaning::Attribute { name: name.clone(), of: of.clone() }),
        }
    }

    /// The predefined type that a class finally is.
    pub fn builtin_of(&mut self, class: ClassId) -> Option<Name> {
        let shape = self.quietly(|table| table.shape(class)).ok()?;
        let enumeration = |table: &Self, class: ClassId| {
            matches!(table.class(class).def.body, ClassBody::Enumeration(_)).then(|| Name::from("enumeration"))
        };
        shape.builtin.clone().or_else(|| shape.frames.iter().find_map(|frame| enumeration(self, frame.class)))
    }

    /// The literals of the enumeration that a class is, with the class that lists them.
    pub fn literals_of(&mut self, class: ClassId) -> Option<(ClassId, Vec<Name>)> {
        let shape = self.quietly(|table| table.shape(class)).ok()?;
        let listed = shape.frames.last()?.class;
        let ClassBody::Enumeration(Some(literals)) = &self.class(listed).def.body else { return None };
        Some((listed, literals.iter().map(|literal| literal.name.name.clone()).collect()))
    }

    fn literal_of(&mut self, class: ClassId, name: &Name) -> Option<Meaning> {
        let (class, literals) = self.literals_of(class)?;
        let position = literals.iter().position(|literal| literal == name)?;
        Some(Meaning::Literal { class, position })
    }

    /// A component of a class, own or inherited; `said`: what is said of the elements of the class from outside.
    pub fn member(&mut self, class: ClassId, name: &Name, said: &[(Arc<AstMod>, ClassId)]) -> Option<Meaning> {
        let Ok(shape) = self.quietly(|table| table.shape(class)) else {
            return self.own_member(class, name, said);
        };
        let element = &shape.elements[*shape.by_name.get(name)? as usize];
        if !element.component {
            return None;
        }
        let owner = shape.frames[element.frame as usize].class;
        let bases = &shape.frames[element.frame as usize].modifications;
        let bases = bases.iter().map(|(frame, tree)| (tree.clone(), shape.frames[*frame as usize].class));
        let around: Vec<_> = said.iter().cloned().chain(bases).collect();
        let def = self.class(owner).def.clone();
        let Some(Element::Component(component)) = elements(&def).get(element.position as usize) else { return None };
        let replaced = element.replaced.and_then(|(frame, position)| {
            let by = shape.frames[frame as usize].class;
            match elements(&self.class(by).def).get(position as usize) {
                Some(Element::Component(original)) => Some((kept(original), by)),
                _ => None,
            }
        });
        Some(Meaning::Component(member_of((owner, class), component, replaced, &around)))
    }

    /// The same where the bases of the class are not understood.
    fn own_member(&mut self, class: ClassId, name: &Name, said: &[(Arc<AstMod>, ClassId)]) -> Option<Meaning> {
        let def = self.class(class).def.clone();
        let component = elements(&def).iter().find_map(|element| match element {
            Element::Component(component) if component.name.name == *name => Some(component),
            _ => None,
        })?;
        Some(Meaning::Component(member_of((class, class), component, None, said)))
    }

    /// What a component is made of, with the redeclarations that are said of it.
    pub fn kind_of(&mut self, member: &Member) -> Option<Kind> {
        self.quietly(|table| table.kind_within(member))
    }

    fn kind_within(&mut self, member: &Member) -> Option<Kind> {
        let redeclared = member.redeclared();
        let (path, owner) = match &redeclared {
            Some((component, by)) => (&component.class, *by),
            None => (&member.component.class, member.owner),
        };
        // What a redeclaration names is looked up where that stands.
        let class = match redeclared.is_some() {
            true => self.type_named(path, owner, owner)?,
            false => match self.redeclared_type(path, &member.around) {
                Some(class) => class,
                None => self.type_named(path, owner, member.of)?,
            },
        };
        Some(Kind { class, said: member.said.clone() })
    }

    /// The class that a redeclaration beside the component puts in the place of the one that its declaration names.
    fn redeclared_type(&mut self, path: &Path, around: &[(Arc<AstMod>, ClassId)]) -> Option<KindClass> {
        let (base, by) = around.iter().find_map(|(tree, by)| {
            let (_, tree) = tree.children.iter().find(|(name, _)| *name == path.parts[0].name)?;
            let Some(Redeclare::Class(nested)) = &tree.redeclare else { return None };
            let ClassBody::Short { base, .. } = &nested.class.body else { return None };
            Some((base.clone(), *by))
        })?;
        let start = self.type_named(&base, by, by)?;
        path.parts[1..].iter().try_fold(start, |kind, name| match kind {
            KindClass::Class(class) => self.member_class(class, &name.name).map(KindClass::Class),
            KindClass::Builtin(_) => None,
        })
    }

    /// The class that a declaration names, seen from a class that may inherit the declaration.
    fn type_named(&mut self, path: &Path, owner: ClassId, heir: ClassId) -> Option<KindClass> {
        let first = &path.parts[0].name;
        if path.parts.len() == 1 && is_builtin(first) {
            return Some(KindClass::Builtin(first.clone()));
        }
        let seen = match path.global || owner == heir {
            true => None,
            false => self.member_class(heir, first),
        };
        let start = match (seen, path.global) {
            (Some(class), _) => Some(class),
            (None, true) => self.top(first),
            (None, false) => self.find_first(owner, first, false),
        };
        let found = path.parts[1..].iter().try_fold(start?, |class, name| self.member_class(class, &name.name))?;
        Some(KindClass::Class(found))
    }

    fn modifier_part(&mut self, modifier: &Modifier, from: ClassId) -> Option<Meaning> {
        let said = vec![(Arc::new(AstMod::from_syntax(&towards(modifier))), from)];
        let mut kind = match self.class_part(&modifier.of, Some(from))? {
            Meaning::Class(class) => Kind { class: KindClass::Class(class), said },
            Meaning::Type(name) => Kind { class: KindClass::Builtin(name), said },
            _ => return None,
        };
        for (k, ident) in modifier.chain.iter().enumerate() {
            let found = self.inside_kind(&kind, &ident.name)?;
            if k + 1 == modifier.chain.len() {
                return Some(found);
            }
            kind = match &found {
                Meaning::Component(member) => self.kind_within(member)?,
                Meaning::Class(class) => Kind { class: KindClass::Class(*class), said: Vec::new() },
                _ => return None,
            };
        }
        None
    }

    /// Where what a name means is declared: the name in its declaration.  None for names of the language.
    pub fn declared(&self, meaning: &Meaning) -> Option<Span> {
        match meaning {
            Meaning::Class(class) => {
                let class = self.class(*class);
                let original = class.original.map_or(class, |original| self.class(original));
                Some(original.def.name.span)
            }
            Meaning::Component(member) => Some(member.component.name.span),
            Meaning::Literal { class, position } => match &self.class(*class).def.body {
                ClassBody::Enumeration(Some(literals)) => literals.get(*position).map(|literal| literal.name.span),
                _ => None,
            },
            Meaning::Iterator(span) => Some(*span),
            Meaning::Type(_) | Meaning::Attribute { .. } | Meaning::Builtin(_) | Meaning::Time => None,
        }
    }

    /// The value of a component, or of an attribute of it: what is said outermost, or what its types say.
    pub fn given(&mut self, member: &Member, attribute: Option<&str>) -> Option<Given> {
        let own = |tree: &Arc<AstMod>| match attribute {
            None => tree.binding.clone(),
            Some(name) => tree.children.iter().find(|(own, _)| **own == *name).and_then(|(_, own)| own.binding.clone()),
        };
        if let Some((value, by)) = member.said.iter().find_map(|(tree, by)| Some((own(tree)?, *by))) {
            return Some(Given { value, by });
        }
        match self.kind_of(member)?.class {
            KindClass::Class(class) => self.given_by_class(class, attribute?),
            KindClass::Builtin(_) => None,
        }
    }

    /// The value that a type gives to an attribute.
    pub fn given_by_class(&mut self, class: ClassId, name: &str) -> Option<Given> {
        let shape = self.quietly(|table| table.shape(class)).ok()?;
        let said = shape.frames.iter().flat_map(|frame| &frame.modifications);
        let found = said.filter_map(|(frame, tree)| {
            let value = tree.children.iter().find(|(own, _)| **own == *name)?.1.binding.clone()?;
            Some(Given { value, by: shape.frames[*frame as usize].class })
        });
        found.take(DEEPEST).next()
    }

    /// The elements of a class, own and inherited, in the order of the text.
    pub fn elements_of(&mut self, class: ClassId) -> Vec<Visible> {
        let names: Vec<(Name, bool)> = match self.quietly(|table| table.shape(class)) {
            Ok(shape) => shape.elements.iter().map(|element| (element.name.clone(), element.component)).collect(),
            Err(_) => {
                let def = self.class(class).def.clone();
                let own = elements(&def).iter().filter_map(|element| match element {
                    Element::Component(component) => Some((component.name.name.clone(), true)),
                    Element::Class(nested) => Some((nested.class.name.name.clone(), false)),
                    _ => None,
                });
                own.collect()
            }
        };
        self.quietly(|table| {
            let element = |(name, component): (Name, bool)| match component {
                true => match table.member(class, &name, &[])? {
                    Meaning::Component(member) => Some(Visible::Component(member)),
                    _ => None,
                },
                false => table.member_class(class, &name).map(|inner| Visible::Class(name, inner)),
            };
            names.into_iter().filter_map(element).collect()
        })
    }

    /// Names of the classes that can be named from inside a class by one name: those around it, imported ones, and libraries.
    pub fn class_names_in(&mut self, from: Option<ClassId>) -> Vec<Name> {
        let mut names = self.quietly(|table| table.class_names_from(from));
        let tops = self.library_names().into_iter().filter_map(|full| full.split('.').next().map(Name::from));
        names.extend(tops);
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// What of a modification concerns the element that a modifier names: what is said of it and of what it is in, and redeclared classes.
fn towards(modifier: &Modifier) -> Modification {
    let first = modifier.chain.first().map(|ident| &ident.name);
    let concerns = |argument: &&Argument| match argument {
        Argument::Modify(modify) => modify.target.parts.first().map(|ident| &ident.name) == first,
        Argument::RedeclareComponent { component, .. } => Some(&component.name.name) == first,
        Argument::RedeclareClass { .. } => true,
    };
    let arguments = modifier.within.arguments.iter().filter(concerns).cloned().collect();
    Modification { arguments, binding: None, span: modifier.within.span }
}

/// What a declaration says of the one that takes its place: the modification of its constraining clause, else its own (Modelica 3.6,
/// section 7.3.2).
fn kept(component: &Component) -> Arc<AstMod> {
    let clause = component.constrained_by.as_ref().map(|clause| &clause.modification);
    Arc::new(AstMod::from_syntax(clause.unwrap_or(&component.modification)))
}

/// A component with what is said of it: by what is around, by redeclarations, then by its own declaration, and by the one that it
/// replaces as a `redeclare` element.
fn member_of(
    (owner, of): (ClassId, ClassId),
    component: &Component,
    replaced: Option<(Arc<AstMod>, ClassId)>,
    around: &[(Arc<AstMod>, ClassId)],
) -> Member {
    let name = &component.name.name;
    let inner = around.iter().flat_map(|(tree, by)| {
        tree.children.iter().filter(|(own, _)| own == name).map(|(_, inner)| (inner.clone(), *by))
    });
    let mut said: Vec<(Arc<AstMod>, ClassId)> = Vec::new();
    let mut is_redeclared = false;
    for (tree, by) in inner {
        match (&tree.redeclare, is_redeclared) {
            (Some(Redeclare::Component(new)), false) => {
                is_redeclared = true;
                said.push((tree.clone(), by));
                said.push((Arc::new(AstMod::from_syntax(&new.modification)), by));
            }
            (Some(Redeclare::Component(new)), true) => said.push((kept(new), by)),
            (_, false) => said.push((tree, by)),
            // What was said of the element before it was redeclared went with it.
            (_, true) => {}
        }
    }
    if is_redeclared {
        said.push((kept(component), owner));
    } else {
        said.push((Arc::new(AstMod::from_syntax(&component.modification)), owner));
        said.extend(replaced);
        if component.constrained_by.is_some() {
            said.push((kept(component), owner));
        }
    }
    Member { owner, of, component: Arc::new(component.clone()), said, around: around.to_vec() }
}
