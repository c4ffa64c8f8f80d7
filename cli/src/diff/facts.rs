//! What a class says, one fact a construct, without layout, comments, order and graphics.
//!
//! A fact has a name by which it is found in the other text (a component, a modified element, a base class) and what it says, as
//! tokens side by side; equations, connections and statements have no name but what they say.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use hyd_source::Span;
use hyd_syntax::tokens::tokens;
use hyd_syntax::tree::{
    Argument, ClassBody, ClassDef, Component, Element, Equation, EquationKind, ImportKind, Modification,
};
use hyd_syntax::{parse, print_expr, print_path, print_reference};

/// Annotations that only say how a class looks or is documented.
const GRAPHICS: [&str; 8] =
    ["Icon", "Diagram", "Placement", "Line", "Documentation", "preferredView", "choicesAllMatching", "Dialog"];

/// Integers up to here are numbers of all their digits.
const LARGEST: f64 = 9e15;

/// What kind of construct a fact is of; facts are listed in this order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Kind {
    /// The class itself: its kind and prefixes.
    Class,
    /// Its description.
    Description,
    /// An import clause.
    Import,
    /// A base class.
    Extends,
    /// A component: prefixes, type and sizes.
    Component,
    /// A value or a modification of a component or a base class.
    Value,
    /// An initial equation.
    InitialEquation,
    /// An equation.
    Equation,
    /// A connection.
    Connection,
    /// A statement of an algorithm.
    Statement,
    /// An annotation that counts.
    Annotation,
}

impl Kind {
    /// The word of reports.
    pub(super) fn word(self) -> &'static str {
        match self {
            Kind::Class => "class",
            Kind::Description => "description",
            Kind::Import => "import",
            Kind::Extends => "extends",
            Kind::Component => "component",
            Kind::Value => "value",
            Kind::InitialEquation => "initial equation",
            Kind::Equation => "equation",
            Kind::Connection => "connection",
            Kind::Statement => "statement",
            Kind::Annotation => "annotation",
        }
    }
}

/// Facts of a class: by kind and name what is said, and how often.
pub(super) type Facts = BTreeMap<(Kind, String), Vec<String>>;

/// The facts of all classes of a text, by their full names; none if it has syntax errors, of which the first is given.
pub(super) fn facts(text: &str) -> Result<BTreeMap<String, Facts>, (usize, String)> {
    let file = hyd_source::Files::new().add("", text);
    let outcome = parse(file, text);
    if let Some(first) = outcome.diagnostics.iter().find(|own| own.severity == hyd_source::Severity::Error) {
        let at = first.labels.first().map_or(0, |label| label.span.start as usize);
        let line = text.as_bytes().iter().take(at).filter(|&&byte| byte == b'\n').count() + 1;
        return Err((line, first.message.clone()));
    }
    let within = outcome.value.within.flatten().map(|path| print_path(&path));
    let mut found = BTreeMap::new();
    let reader = Reader { text };
    for class in &outcome.value.classes {
        reader.class(class, within.as_deref().unwrap_or_default(), &mut found);
    }
    Ok(found)
}

struct Reader<'t> {
    text: &'t str,
}

impl Reader<'_> {
    /// What a span says: its tokens with a blank between them, comments left out.
    fn said(&self, span: Span) -> String {
        let part = self.text.get(span.start as usize..span.end as usize).unwrap_or_default();
        let words: Vec<&str> = tokens(part).filter(|token| !token.is_comment()).map(|token| token.text).collect();
        tight(&words)
    }

    fn class(&self, class: &Arc<ClassDef>, within: &str, found: &mut BTreeMap<String, Facts>) {
        let name =
            if within.is_empty() { class.name.name.to_string() } else { format!("{within}.{}", class.name.name) };
        let mut facts = Facts::new();
        let mut add = |kind: Kind, name: String, says: String| facts.entry((kind, name)).or_default().push(says);
        let prefixes =
            [(class.encapsulated, "encapsulated"), (class.partial, "partial"), (class.expandable, "expandable")];
        let mut words: Vec<&str> = prefixes.iter().filter(|(is, _)| *is).map(|(_, word)| *word).collect();
        words.extend(class.pure.map(|pure| if pure { "pure" } else { "impure" }));
        words.push(class.kind.keyword());
        add(Kind::Class, String::new(), words.join(" "));
        if let Some(description) = &class.description {
            add(Kind::Description, String::new(), description.to_string());
        }
        if let Some(annotation) = &class.annotation {
            self.annotations(annotation, &mut add);
        }
        match &class.body {
            ClassBody::Long { elements, equations, algorithms, external, extends_from } => {
                for element in elements {
                    self.element(element, &name, &mut add, found);
                }
                if let Some(modification) = extends_from {
                    self.modified(modification, "", &mut add);
                }
                for section in equations {
                    for equation in &section.equations {
                        let (kind, says) = self.equation(equation, section.initial);
                        add(kind, String::new(), says);
                    }
                }
                for (k, section) in algorithms.iter().enumerate() {
                    // The order of statements counts: each has its place.
                    for (n, statement) in section.statements.iter().enumerate() {
                        add(Kind::Statement, format!("{}.{}", k + 1, n + 1), self.said(statement.span));
                    }
                }
                if let Some(external) = external {
                    add(Kind::Statement, "external".to_string(), self.said(external.span));
                }
            }
            // Nothing in them has a name of its own.
            ClassBody::Short { .. } | ClassBody::Enumeration(_) | ClassBody::DerivativeOf(..) => {
                add(Kind::Class, "definition".to_string(), self.said(class.span));
            }
        }
        found.insert(name, facts);
    }

    fn element(
        &self,
        element: &Element,
        within: &str,
        add: &mut impl FnMut(Kind, String, String),
        found: &mut BTreeMap<String, Facts>,
    ) {
        match element {
            Element::Import(import) => {
                let what = match &import.what {
                    ImportKind::Qualified => String::new(),
                    ImportKind::Renamed(name) => name.name.to_string(),
                    ImportKind::All => "*".to_string(),
                    ImportKind::Several(names) => {
                        names.iter().map(|own| own.name.as_ref()).collect::<Vec<_>>().join(", ")
                    }
                };
                add(Kind::Import, print_path(&import.path), what);
            }
            Element::Extends(extends) => {
                let base = print_path(&extends.base);
                add(Kind::Extends, base, if extends.protected { "protected".to_string() } else { String::new() });
                self.modified(&extends.modification, "", add);
            }
            Element::Class(nested) => {
                self.class(&nested.class, within, found);
                let mut words: Vec<String> = prefixes(&nested.prefixes);
                if let Some(constraint) = &nested.constrained_by {
                    words.push(format!("constrainedby {}", print_path(&constraint.base)));
                }
                if !words.is_empty() {
                    add(Kind::Component, nested.class.name.name.to_string(), words.join(" "));
                }
            }
            Element::Component(component) => self.component(component, "", add),
        }
    }

    fn component(&self, component: &Component, before: &str, add: &mut impl FnMut(Kind, String, String)) {
        let name = format!("{before}{}", component.name.name);
        let mut words: Vec<String> = prefixes(&component.prefixes);
        let flags = [(component.flow, "flow"), (component.stream, "stream")];
        words.extend(flags.iter().filter(|(is, _)| *is).map(|(_, word)| (*word).to_string()));
        let variability = match component.variability {
            hyd_syntax::tree::Variability::Constant => Some("constant"),
            hyd_syntax::tree::Variability::Parameter => Some("parameter"),
            hyd_syntax::tree::Variability::Discrete => Some("discrete"),
            hyd_syntax::tree::Variability::Continuous => None,
        };
        words.extend(variability.map(str::to_string));
        words.extend(component.direction.map(|own| match own {
            hyd_syntax::tree::Direction::Input => "input".to_string(),
            hyd_syntax::tree::Direction::Output => "output".to_string(),
        }));
        words.push(print_path(&component.class));
        if !component.dims.is_empty() {
            let sizes: Vec<String> = component.dims.iter().map(print_expr).collect();
            words.push(format!("[{}]", sizes.join(", ")));
        }
        if let Some(condition) = &component.condition {
            words.push(format!("if {}", print_expr(condition)));
        }
        if let Some(constraint) = &component.constrained_by {
            words.push(format!("constrainedby {}", print_path(&constraint.base)));
        }
        add(Kind::Component, name.clone(), words.join(" "));
        if let Some(description) = &component.description {
            add(Kind::Description, name.clone(), description.to_string());
        }
        if let Some(constraint) = &component.constrained_by {
            self.modified(&constraint.modification, &format!("{name} (constrainedby)"), add);
        }
        self.modified(&component.modification, &name, add);
        if let Some(annotation) = &component.annotation {
            self.annotations(annotation, &mut |kind, own, says| add(kind, format!("{name}.{own}"), says));
        }
    }

    /// The values that a modification gives, each by the name of what it modifies.
    fn modified(&self, modification: &Modification, name: &str, add: &mut impl FnMut(Kind, String, String)) {
        if let Some(binding) = &modification.binding {
            add(Kind::Value, name.to_string(), print_expr(binding));
        }
        for argument in &modification.arguments {
            let joined = |own: &str| if name.is_empty() { own.to_string() } else { format!("{name}.{own}") };
            match argument {
                Argument::Modify(own) => {
                    let target = joined(&print_path(&own.target));
                    let words = [(own.each, "each"), (own.is_final, "final")];
                    let words: Vec<&str> = words.iter().filter(|(is, _)| *is).map(|(_, word)| *word).collect();
                    if !words.is_empty() {
                        add(Kind::Value, format!("{target} ({})", words.join(" ")), words.join(" "));
                    }
                    self.modified(&own.modification, &target, add);
                }
                Argument::RedeclareComponent { component, .. } => {
                    let target = joined(&component.name.name);
                    add(Kind::Value, target.clone(), format!("redeclare {}", print_path(&component.class)));
                    self.modified(&component.modification, &target, add);
                }
                Argument::RedeclareClass { class, .. } => {
                    let target = joined(&class.class.name.name);
                    // Whatever it is made of.
                    add(Kind::Value, target, self.said(class.class.span));
                }
            }
        }
    }

    /// Annotations that say more than how a class looks.
    fn annotations(&self, annotation: &Modification, add: &mut impl FnMut(Kind, String, String)) {
        for argument in &annotation.arguments {
            let Argument::Modify(own) = argument else { continue };
            let name = print_path(&own.target);
            if !GRAPHICS.contains(&name.as_str()) {
                self.modified(&own.modification, &name, &mut |_, name, says| add(Kind::Annotation, name, says));
            }
        }
    }

    fn equation(&self, equation: &Equation, initial: bool) -> (Kind, String) {
        match &equation.kind {
            // The ends of a connection are equal.
            EquationKind::Connect(a, b) => {
                let mut ends = [print_reference(a), print_reference(b)];
                ends.sort_unstable();
                (Kind::Connection, format!("connect({})", ends.join(", ")))
            }
            _ if initial => (Kind::InitialEquation, self.said(equation.span)),
            _ => (Kind::Equation, self.said(equation.span)),
        }
    }
}

fn prefixes(own: &hyd_syntax::tree::ElementPrefixes) -> Vec<String> {
    let all = [
        (own.protected, "protected"),
        (own.redeclare, "redeclare"),
        (own.is_final, "final"),
        (own.inner, "inner"),
        (own.outer, "outer"),
        (own.replaceable, "replaceable"),
    ];
    all.iter().filter(|(is, _)| *is).map(|(_, word)| (*word).to_string()).collect()
}

/// What a fact says with numbers by what they are, however they are written: what two texts are compared by.
pub(super) fn compared(says: &str) -> String {
    tokens(says).map(|token| number(token.text)).collect::<Vec<_>>().join(" ")
}

/// `1.0` and `1` are one number, as are `1e5` and `100000`; other tokens stay.
fn number(token: &str) -> Cow<'_, str> {
    let is_number = token.starts_with(|first: char| first.is_ascii_digit() || first == '.');
    match token.parse::<f64>() {
        // All digits of larger integers count.
        Ok(value) if is_number && value.abs() < LARGEST => {
            Cow::Owned(format!("{value:?}").trim_end_matches(".0").to_string())
        }
        _ => Cow::Borrowed(token),
    }
}

/// Tokens as one writes them in a line.
fn tight(words: &[&str]) -> String {
    let mut text = String::new();
    for (k, word) in words.iter().enumerate() {
        let before = k.checked_sub(1).map(|k| words[k]);
        let is_tight = matches!(*word, "(" | ")" | "," | ";" | "." | "[" | "]" | "^" | "*" | "/" | "}" | ":")
            || matches!(before, None | Some("(" | "." | "[" | "^" | "*" | "/" | "{" | ":"));
        // A bracket that does not belong to a name stands apart.
        let is_apart = *word == "("
            && matches!(before, Some("=" | "+" | "-" | "then" | "else" | "and" | "or" | "not" | "if" | "in"));
        if !is_tight || is_apart {
            text.push(' ');
        }
        text.push_str(word);
    }
    text.trim_start().to_string()
}
