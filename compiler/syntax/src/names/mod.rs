//! Every place of a text where a name stands, with what the grammar says that it is there for.
//!
//! For tools that answer questions about a position: what stands there, who else uses it.  Nothing is looked up: a place tells in which
//! class its name is to be looked up, and as what.  Of annotations it has the names that are the model's (`annotations`).

mod annotations;

use std::sync::Arc;

use hyd_source::Span;

use crate::tokens::{Token, tokens};
use crate::tree::{
    Argument, Arguments, ClassBody, ClassDef, Component, ComponentRef, Constraint, Element, Equation, Expr, ExprKind,
    Ident, ImportKind, Iterator, Modification, Name, NestedClass, Path, Statement, StoredDefinition,
};
use crate::visit::{self, Role, Visitor};

/// A class of the text.
#[derive(Clone, Debug)]
pub struct ClassPlace {
    /// The class.
    pub def: Arc<ClassDef>,
    /// The class around it: a position in [`Names::classes`].
    pub parent: Option<usize>,
}

/// All names of a text.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// The package that `within` names.
    pub within: Vec<Ident>,
    /// All classes, each before those inside.
    pub classes: Vec<ClassPlace>,
    /// The names in the order of the text.
    pub places: Vec<Place>,
}

/// A name in the text.
#[derive(Clone, Debug)]
pub struct Place {
    /// The name and where it stands.
    pub ident: Ident,
    /// The class that it is looked up in: a position in [`Names::classes`]; none for `within`.
    pub class: Option<usize>,
    /// What it is there for.
    pub purpose: Purpose,
}

/// What a name is there for.
#[derive(Clone, Debug)]
pub enum Purpose {
    /// It names the class that begins here, which `class` of the place is.
    DeclaresClass,
    /// It repeats the name of that class at its end.
    EndsClass,
    /// It declares a component.
    DeclaresComponent(Arc<Component>),
    /// It declares a literal of the enumeration.
    DeclaresLiteral,
    /// It declares a loop variable.
    DeclaresIterator,
    /// Part of the name of a class.
    Class(ClassPart),
    /// Part of a reference.
    Reference(ReferencePart),
    /// The name of an element that is modified.
    Modifier(Modifier),
    /// The name of an argument of a call.
    Argument {
        /// What is called.
        function: ReferencePart,
    },
}

/// Part of the name of a class.
#[derive(Clone, Debug)]
pub struct ClassPart {
    /// The whole name.
    pub path: Arc<Path>,
    /// Which part.
    pub at: usize,
    /// Named as a base, which inherited classes are not visible for.
    pub base: bool,
    /// Looked up from the top, as imports are.
    pub import: bool,
}

/// Part of a reference.
#[derive(Clone, Debug)]
pub struct ReferencePart {
    /// The names of its parts.
    pub parts: Arc<[Ident]>,
    /// Which part.
    pub at: usize,
    /// It begins with a dot.
    pub global: bool,
    /// What it is there for.
    pub role: Role,
    /// The loop variable that it begins with.
    pub iterator: Option<Span>,
}

/// The name of an element that is modified: the last of a chain of elements, each inside the one before.
#[derive(Clone, Debug)]
pub struct Modifier {
    /// The class that is modified.
    pub of: ClassPart,
    /// The elements.
    pub chain: Arc<[Ident]>,
    /// The whole modification of the class.
    pub within: Arc<Modification>,
}

/// All names of a text and its tree.
pub fn names(stored: &StoredDefinition, text: &str) -> Names {
    let mut collector = Collector {
        text,
        found: Names::default(),
        class: None,
        iterators: Vec::new(),
        last_type: None,
        in_annotation: false,
    };
    if let Some(Some(path)) = &stored.within {
        collector.found.within.clone_from(&path.parts);
        collector.class_path(path, false, true);
    }
    stored.classes.iter().for_each(|class| collector.class(class));
    collector.found.places.sort_by_key(|place| place.ident.span.start);
    collector.found
}

impl Names {
    /// The place whose name covers a byte of the text, or ends there.
    pub fn at(&self, byte: u32) -> Option<&Place> {
        let behind = self.places.partition_point(|place| place.ident.span.start <= byte);
        let place = self.places.get(behind.checked_sub(1)?)?;
        (byte <= place.ident.span.end).then_some(place)
    }

    /// The innermost class around a byte of the text.
    pub fn class_around(&self, byte: u32) -> Option<usize> {
        let around = |class: &ClassPlace| class.def.span.start <= byte && byte <= class.def.span.end;
        self.classes.iter().rposition(around)
    }

    /// The names of the classes around a class and its own, outermost first.
    pub fn path_of(&self, class: usize) -> Vec<Name> {
        let mut names = Vec::new();
        let mut current = Some(class);
        while let Some(place) = current.and_then(|at| self.classes.get(at)) {
            names.push(place.def.name.name.clone());
            current = place.parent;
        }
        names.reverse();
        names
    }
}

struct Collector<'t> {
    text: &'t str,
    found: Names,
    class: Option<usize>,
    iterators: Vec<Ident>,
    /// Where the type of the last component stands.
    last_type: Option<Span>,
    /// Names of tools stand beside those of the model.
    in_annotation: bool,
}

impl Collector<'_> {
    fn push(&mut self, ident: &Ident, purpose: Purpose) {
        self.found.places.push(Place { ident: ident.clone(), class: self.class, purpose });
    }

    fn class(&mut self, def: &Arc<ClassDef>) {
        let around = self.class;
        self.class = Some(self.found.classes.len());
        self.found.classes.push(ClassPlace { def: def.clone(), parent: around });
        self.push(&def.name, Purpose::DeclaresClass);
        self.body(def);
        self.annotation(def.annotation.as_ref());
        self.class = around;
    }

    fn body(&mut self, def: &ClassDef) {
        match &def.body {
            ClassBody::Long { elements, equations, algorithms, external, extends_from } => {
                self.end_name(def);
                elements.iter().for_each(|element| self.element(element));
                equations.iter().flat_map(|section| &section.equations).for_each(|e| self.equation(e));
                algorithms.iter().flat_map(|section| &section.statements).for_each(|s| self.statement(s));
                if let Some(call) = external.as_ref().and_then(|external| external.call.as_ref()) {
                    call.output.iter().for_each(|output| self.reference(output, Role::Assigned));
                    call.arguments.iter().for_each(|argument| self.expr(argument));
                }
                if let Some(modification) = extends_from {
                    let path = Path { global: false, parts: vec![def.name.clone()], span: def.name.span };
                    let of = ClassPart { path: Arc::new(path), at: 0, base: true, import: false };
                    self.modification(&of, modification);
                }
            }
            ClassBody::Short { base, dims, modification, .. } => {
                let of = self.class_path(base, true, false);
                dims.iter().for_each(|size| self.expr(size));
                self.modification(&of, modification);
            }
            ClassBody::Enumeration(literals) => {
                for literal in literals.iter().flatten() {
                    self.push(&literal.name, Purpose::DeclaresLiteral);
                }
            }
            ClassBody::DerivativeOf(path, _) => {
                self.class_path(path, true, false);
            }
        }
    }

    /// The name after `end`, which the tree does not have.
    fn end_name(&mut self, def: &ClassDef) {
        let from = def.name.span.end as usize;
        let Some(inside) = self.text.get(from..def.span.end as usize) else { return };
        let name = &def.name.name;
        // A constraint may stand behind it.
        let start = match inside.strip_suffix(&**name) {
            Some(before) if before.trim_end().ends_with("end") => Some(before.len()),
            _ => {
                let words: Vec<Token<'_>> = tokens(inside).filter(|token| !token.is_comment()).collect();
                let end = words.windows(2).rfind(|pair| pair[0].is("end") && pair[1].is(name));
                end.map(|pair| pair[1].at)
            }
        };
        if let Some(start) = start.map(|start| from + start) {
            let span = Span::new(def.span.file, start, start + name.len());
            self.push(&Ident { name: name.clone(), span }, Purpose::EndsClass);
        }
    }

    fn element(&mut self, element: &Element) {
        match element {
            Element::Import(import) => {
                self.class_path(&import.path, false, true);
                if let ImportKind::Several(names) = &import.what {
                    for name in names {
                        let mut path = import.path.clone();
                        path.parts.push(name.clone());
                        let at = path.parts.len() - 1;
                        let part = ClassPart { path: Arc::new(path), at, base: false, import: true };
                        self.push(name, Purpose::Class(part));
                    }
                }
                if let ImportKind::Renamed(alias) = &import.what {
                    let (path, at) = (Arc::new(import.path.clone()), import.path.parts.len() - 1);
                    self.push(alias, Purpose::Class(ClassPart { path, at, base: false, import: true }));
                }
            }
            Element::Extends(extends) => {
                let of = self.class_path(&extends.base, true, false);
                self.modification(&of, &extends.modification);
                self.annotation(extends.annotation.as_ref());
            }
            Element::Class(nested) => {
                self.class(&nested.class);
                self.constraint(nested.constrained_by.as_ref());
            }
            Element::Component(component) => {
                self.push(&component.name, Purpose::DeclaresComponent(Arc::new(component.clone())));
                self.component(component);
            }
        }
    }

    /// What is said of a component beside its name.
    fn component(&mut self, component: &Component) {
        // Of `Real x, y;` the type is one place.
        let of = match self.last_type.replace(component.class.span) == Some(component.class.span) {
            true => self.part_of(&component.class, false, false),
            false => self.class_path(&component.class, false, false),
        };
        component.dims.iter().for_each(|size| self.expr(size));
        component.condition.iter().for_each(|condition| self.expr(condition));
        self.modification(&of, &component.modification);
        self.constraint(component.constrained_by.as_ref());
        self.annotation(component.annotation.as_ref());
    }

    fn constraint(&mut self, constraint: Option<&Constraint>) {
        let Some(Constraint { base, modification }) = constraint else { return };
        let of = self.class_path(base, false, false);
        self.modification(&of, modification);
    }

    fn part_of(&self, path: &Path, base: bool, import: bool) -> ClassPart {
        ClassPart { path: Arc::new(path.clone()), at: path.parts.len().saturating_sub(1), base, import }
    }

    /// Adds the parts of the name of a class; gives its last.
    fn class_path(&mut self, path: &Path, base: bool, import: bool) -> ClassPart {
        let whole = self.part_of(path, base, import);
        for (at, ident) in path.parts.iter().enumerate() {
            self.push(ident, Purpose::Class(ClassPart { at, ..whole.clone() }));
        }
        whole
    }

    fn modification(&mut self, of: &ClassPart, modification: &Modification) {
        if modification.arguments.is_empty() {
            modification.binding.iter().for_each(|value| self.expr(value));
            return;
        }
        let within = Arc::new(modification.clone());
        self.modification_within((of, &within), &[], modification);
    }

    fn modification_within(
        &mut self,
        of: (&ClassPart, &Arc<Modification>),
        around: &[Ident],
        modification: &Modification,
    ) {
        modification.binding.iter().for_each(|value| self.expr(value));
        for argument in &modification.arguments {
            match argument {
                Argument::Modify(modify) => {
                    let mut chain = around.to_vec();
                    for ident in &modify.target.parts {
                        chain.push(ident.clone());
                        self.modifier(of, &chain);
                    }
                    self.modification_within(of, &chain, &modify.modification);
                }
                Argument::RedeclareComponent { component, .. } => {
                    self.modifier(of, &[around, std::slice::from_ref(&component.name)].concat());
                    self.component(component);
                }
                Argument::RedeclareClass { class, .. } => {
                    self.modifier(of, &[around, std::slice::from_ref(&class.class.name)].concat());
                    self.redeclared(class);
                }
            }
        }
    }

    fn modifier(&mut self, (of, within): (&ClassPart, &Arc<Modification>), chain: &[Ident]) {
        let Some(last) = chain.last() else { return };
        let modifier = Modifier { of: of.clone(), chain: chain.into(), within: within.clone() };
        self.push(&last.clone(), Purpose::Modifier(modifier));
    }

    /// The class that takes the place of another: its names are looked up where the modification is written.
    fn redeclared(&mut self, nested: &NestedClass) {
        if let ClassBody::Short { base, dims, modification, .. } = &nested.class.body {
            let of = self.class_path(base, false, false);
            dims.iter().for_each(|size| self.expr(size));
            self.modification(&of, modification);
        }
        self.constraint(nested.constrained_by.as_ref());
    }

    fn iterator(&self, name: &Name) -> Option<Span> {
        self.iterators.iter().rev().find(|iterator| iterator.name == *name).map(|iterator| iterator.span)
    }

    fn whole_reference(&self, reference: &ComponentRef, role: Role) -> ReferencePart {
        let parts: Arc<[Ident]> = reference.parts.iter().map(|part| part.name.clone()).collect();
        let iterator = if reference.global { None } else { self.iterator(&parts[0].name) };
        let at = parts.len() - 1;
        ReferencePart { parts, at, global: reference.global, role, iterator }
    }

    fn arguments_of(&mut self, function: &ComponentRef, arguments: &Arguments) {
        let Arguments::List { named, .. } = arguments else { return };
        let function = self.whole_reference(function, Role::Called);
        for (name, _) in named {
            self.push(name, Purpose::Argument { function: function.clone() });
        }
    }
}

impl Visitor for Collector<'_> {
    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        let whole = self.whole_reference(reference, role);
        for (at, part) in reference.parts.iter().enumerate() {
            self.push(&part.name, Purpose::Reference(ReferencePart { at, ..whole.clone() }));
        }
        visit::walk_reference(self, reference);
    }

    fn expr(&mut self, expr: &Expr) {
        if self.in_annotation && self.annotated(expr) {
            return;
        }
        if let ExprKind::Call(function, arguments) = &expr.kind {
            self.arguments_of(function, arguments);
        }
        visit::walk_expr(self, expr);
    }

    fn equation(&mut self, equation: &Equation) {
        if let crate::tree::EquationKind::Call(function, arguments) = &equation.kind {
            self.arguments_of(function, arguments);
        }
        visit::walk_equation(self, equation);
    }

    fn statement(&mut self, statement: &Statement) {
        if let crate::tree::StatementKind::Call(function, arguments)
        | crate::tree::StatementKind::AssignTuple(_, function, arguments) = &statement.kind
        {
            self.arguments_of(function, arguments);
        }
        visit::walk_statement(self, statement);
    }

    fn enter(&mut self, iterators: &[Iterator]) {
        for iterator in iterators {
            iterator.range.iter().for_each(|range| self.expr(range));
            self.push(&iterator.name, Purpose::DeclaresIterator);
            self.iterators.push(iterator.name.clone());
        }
    }

    fn leave(&mut self, iterators: &[Iterator]) {
        self.iterators.truncate(self.iterators.len().saturating_sub(iterators.len()));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Of annotations the names of the model are found, in texts, too, and none of the tools.
    #[test]
    fn names_in_annotations_are_found() {
        let text = "model M\n  Real x annotation(Dialog(enable = use_x));\n  annotation(Icon(graphics = {Text(extent = {{0, 0}, \
                    {1, 1}}, textString = \"%name %R %{q.r[1].s} %%\", visible = on), Line(pattern = LinePattern.Dash)}), \
                    Documentation(info = \"100 %x\", figures = {Figure(caption = \"see %{y} of %x\", plots = {Plot(curves = \
                    {Curve(x = time, y = a.b)})})}), choices(choice(redeclare model A = P.B \"b\")));\nend M;\n";
        let mut files = hyd_source::Files::new();
        let file = files.add("m", text);
        let parsed = crate::parse(file, text);
        assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
        let found = names(&parsed.value, text);
        let said: Vec<&str> = found.places.iter().map(|place| &*place.ident.name).collect();
        assert_eq!(said.join(" "), "M Real x use_x R q r s on LinePattern Dash y time a b P B M");
        let spelt = |place: &Place| text[place.ident.span.start as usize..place.ident.span.end as usize].to_string();
        assert!(found.places.iter().all(|place| spelt(place) == *place.ident.name));
    }

    #[test]
    fn all_names_are_found_with_their_purposes() {
        let text = "within P;\nmodel M \"m\"\n  extends B(a(b = c));\n  Real x, y[n](start = 1);\n  import Q = A.C;\n  \
                    D d(redeclare model E = F(g = h));\nequation\n  for i in 1:n loop\n    x = A.f(i, k = y[i]);\n  end for;\nend M;\n";
        let mut files = hyd_source::Files::new();
        let file = files.add("m", text);
        let parsed = crate::parse(file, text);
        assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
        let found = names(&parsed.value, text);
        let kind = |place: &Place| match &place.purpose {
            Purpose::DeclaresClass => "class".to_string(),
            Purpose::EndsClass => "end".into(),
            Purpose::DeclaresComponent(_) => "component".into(),
            Purpose::DeclaresLiteral => "literal".into(),
            Purpose::DeclaresIterator => "iterator".into(),
            Purpose::Class(part) => format!("{}{}", if part.base { "base" } else { "of" }, part.at),
            Purpose::Reference(part) if part.iterator.is_some() => "loop".into(),
            Purpose::Reference(part) => format!("ref{}", part.at),
            Purpose::Modifier(modifier) => format!("mod{}", modifier.chain.len()),
            Purpose::Argument { .. } => "argument".into(),
        };
        let said: Vec<String> =
            found.places.iter().map(|place| format!("{}:{}", place.ident.name, kind(place))).collect();
        assert_eq!(
            said.join(" "),
            "P:of0 M:class B:base0 a:mod1 b:mod2 c:ref0 Real:of0 x:component y:component n:ref0 start:mod1 Q:of1 A:of0 \
             C:of1 D:of0 d:component E:mod1 F:of0 g:mod1 h:ref0 i:iterator n:ref0 x:ref0 A:ref0 f:ref1 i:loop \
             k:argument y:ref0 i:loop M:end"
        );
        let at = text.find("f(i").unwrap() as u32;
        assert_eq!(&*found.at(at + 1).unwrap().ident.name, "f");
        assert_eq!(found.path_of(found.class_around(at).unwrap()).join("."), "M");
        assert_eq!(text[found.places.last().unwrap().ident.span.start as usize..].trim(), "M;");
    }
}
