//! A file: its flat list of items to classes in classes.
//!
//! Open classes stand on a stack.  An `end Name` closes the innermost open class of that name; classes inside that are
//! still open get one message each.  An `end` with an unknown name closes the innermost class (misspelt name).  Items
//! outside of any class are reported once per stretch.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, FileId, Outcome, Span, did_you_mean};

use crate::build::Builder;
use crate::build_element::{ClassHead, Prefixes};
use crate::grammar::{self, Node, Rule};
use crate::recovery::Place;
use crate::scan::{self, Scan};
use crate::tree::{
    AlgorithmSection, ClassBody, ClassDef, Element, EquationSection, External, Ident, Modification, Name, NestedClass,
    Path, StoredDefinition,
};

/// A class whose `end` has not come yet.
struct OpenClass {
    prefixes: Prefixes,
    head: ClassHead,
    name: Ident,
    /// The head could not be read; the class is dropped with all it holds.
    broken: bool,
    description: Option<Name>,
    start: Span,
    protected: bool,
    in_code: bool,
    elements: Vec<Element>,
    equations: Vec<EquationSection>,
    algorithms: Vec<AlgorithmSection>,
    external: Option<External>,
    extends_from: Option<Modification>,
    annotation: Option<Modification>,
}

/// Parses one file.
///
/// The tree holds what could be understood; the messages (codes `E01xx`) say what could not, all of one file in one run
/// and in the order of the text.  Never fails and never panics: texts beyond the limits give an empty tree and a message.
pub fn parse(file: FileId, text: &str) -> Outcome<StoredDefinition> {
    let mut scan = scan::scan(file, text);
    let empty = StoredDefinition { within: None, classes: Vec::new() };
    if scan.fatal {
        return Outcome { value: empty, diagnostics: scan.diagnostics };
    }
    let clean = std::mem::take(&mut scan.text);
    let nodes = match grammar::run(Rule::file, &clean) {
        Ok(nodes) => nodes,
        Err(failure) => {
            let at = Span::new(file, failure.at, failure.at);
            let message = "reading was given up here: the text is too large or too deeply nested";
            scan.diagnostics.push(Diagnostic::error(Code::Limit, message).at(at, ""));
            return Outcome { value: empty, diagnostics: scan.diagnostics };
        }
    };
    let mut reader =
        FileReader { builder: Builder::new(file, &clean), open: Vec::new(), definition: empty, outside: false };
    let items: Vec<Node<'_>> = nodes.flat_map(Node::into_inner).collect();
    reader.builder.truncated = scan.unreliable_from.is_some();
    reader.note_ends(&items);
    for item in items {
        reader.item(item);
        if reader.builder.gave_up {
            break;
        }
    }
    reader.finish();
    let diagnostics = merge(scan, &clean, reader.builder.diagnostics);
    Outcome { value: reader.definition, diagnostics }
}

/// Both lists in the order of the text, without the consequences of foreign characters and of what has no end.
pub(crate) fn merge(scan: Scan, text: &str, built: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let place = |d: &Diagnostic| d.labels.iter().find(|l| l.primary).map_or(0, |l| l.span.start);
    let limit = scan.unreliable_from.map(|at| at as u32);
    let mut all = scan.diagnostics;
    let foreign =
        |at: u32| !scan.foreign_lines.is_empty() && scan.foreign_lines.contains(&scan::line_start(text, at as usize));
    all.extend(built.into_iter().filter(|d| limit.is_none_or(|limit| place(d) < limit) && !foreign(place(d))));
    all.sort_by_key(place);
    all
}

struct FileReader<'t> {
    builder: Builder<'t>,
    open: Vec<OpenClass>,
    definition: StoredDefinition,
    /// A message about text outside of classes has just been given.
    outside: bool,
}

impl<'t> FileReader<'t> {
    fn note_ends(&mut self, items: &[Node<'t>]) {
        for item in items.iter().filter(|n| matches!(n.as_rule(), Rule::class_end | Rule::bad_element)) {
            if let ["end", name, ..] = self.builder.leading_words(item).as_slice() {
                self.builder.ends.insert(*name, item.as_span().start());
            }
        }
    }

    fn item(&mut self, node: Node<'t>) {
        match node.as_rule() {
            Rule::EOI => {}
            Rule::class_end => self.class_end(node),
            Rule::element => self.element(node),
            Rule::within => self.within(node),
            Rule::bad_element => self.bad_element(&node),
            Rule::stray_semi => self.builder.stray_semi(&node),
            Rule::block_end if self.builder.lost => {}
            Rule::block_end => {
                let span = self.builder.trimmed_span(&node);
                self.builder.error(span, format!("`{}` closes nothing here", one_line(self.builder.text, span)));
            }
            _ if self.open.is_empty() => self.stray(&node),
            _ => self.inside(node),
        }
    }

    /// Items that need an open class.
    fn inside(&mut self, node: Node<'t>) {
        let rule = node.as_rule();
        let Some(class) = self.open.last_mut() else { return };
        if matches!(rule, Rule::import | Rule::extends) {
            self.builder.recovered = false;
            self.builder.check_terminator(&node, "this clause");
        }
        match rule {
            Rule::import => class.elements.extend(self.builder.import(node).map(Element::Import)),
            Rule::extends => {
                class.elements.extend(self.builder.extends(node, class.protected).map(Element::Extends));
            }
            Rule::visibility => {
                class.protected = node.as_str() == "protected";
                class.in_code = false;
            }
            Rule::external => class.external = Some(self.builder.external(node)),
            Rule::class_annotation => {
                if let Some((span, annotation)) = self.builder.class_annotation(node) {
                    self.annotate(span, annotation);
                }
            }
            Rule::code_section => self.code_section(node),
            _ => {}
        }
    }

    fn annotate(&mut self, span: Span, annotation: Modification) {
        let Some(class) = self.open.last_mut() else { return };
        if class.annotation.is_some() {
            self.builder
                .error(span, "a class has only one annotation")
                .notes
                .push("put all entries into one `annotation(...)`".into());
        } else {
            class.annotation = Some(annotation);
        }
    }

    fn code_section(&mut self, node: Node<'t>) {
        let span = self.builder.trimmed_span(&node);
        let mut nodes = node.into_inner();
        let head = nodes.next().map_or("", |n| n.as_str());
        let initial = head.starts_with("initial");
        self.builder.recovered = false;
        let annotations = if head.ends_with("equation") {
            let (equations, annotations) = self.builder.code(nodes);
            if let Some(class) = self.open.last_mut() {
                class.in_code = true;
                class.equations.push(EquationSection { initial, equations });
            }
            annotations
        } else {
            let (statements, annotations) = self.builder.code(nodes);
            if let Some(class) = self.open.last_mut() {
                class.in_code = true;
                class.algorithms.push(AlgorithmSection { initial, statements, span });
            }
            annotations
        };
        for (span, annotation) in annotations {
            self.annotate(span, annotation);
        }
    }

    fn within(&mut self, node: Node<'t>) {
        let span = self.builder.trimmed_span(&node);
        self.builder.check_terminator(&node, "`within`");
        if self.definition.within.is_some() || !self.definition.classes.is_empty() || !self.open.is_empty() {
            self.builder.error(span, "`within` can stand only once, at the beginning of the file");
            return;
        }
        let path: Option<Path> = node.into_inner().find(|n| n.as_rule() == Rule::path).map(|n| self.builder.path(n));
        self.definition.within = Some(path);
    }

    fn stray(&mut self, node: &Node<'t>) {
        if !self.outside {
            let span = first_line(self.builder.text, self.builder.trimmed_span(node));
            let message = match self.definition.classes.last() {
                Some(last) => format!("this stands outside of any class, after `end {};`", last.name.name),
                None => "this stands outside of any class".to_string(),
            };
            self.builder
                .error(span, message)
                .notes
                .push("a file consists of classes: `model Name ... end Name;`".into());
        }
        self.outside = true;
    }

    fn bad_element(&mut self, node: &Node<'t>) {
        if self.open.is_empty() && !self.builder.begins_class(node) {
            return self.stray(node);
        }
        let place = if self.open.last().is_some_and(|c| c.in_code) { Place::AfterCode } else { Place::Element };
        let words = self.builder.leading_words(node);
        if let ["end", name, ..] = words.as_slice()
            && self.open.last().is_some_and(|class| class.broken && &*class.name.name == *name)
        {
            self.open.pop();
            return;
        }
        if self.builder.misspelt_head(node) || self.builder.lost && !self.builder.begins_class(node) {
            return;
        }
        if let Some(name) = self.builder.bad_fragment(node, place).class {
            let span = self.builder.span(node);
            let name = Ident { name: self.builder.name(name), span };
            self.push(Prefixes::default(), ClassHead::default(), name, span, true);
        }
    }

    fn push(&mut self, prefixes: Prefixes, head: ClassHead, name: Ident, start: Span, broken: bool) {
        self.outside = false;
        self.builder.check_depth(self.open.len(), start);
        self.open.push(OpenClass {
            prefixes,
            head,
            name,
            broken,
            description: None,
            start,
            protected: false,
            in_code: false,
            elements: Vec::new(),
            equations: Vec::new(),
            algorithms: Vec::new(),
            external: None,
            extends_from: None,
            annotation: None,
        });
    }

    fn element(&mut self, node: Node<'t>) {
        let span = self.builder.trimmed_span(&node);
        let mut prefixes = Prefixes::default();
        let mut head = None;
        let mut constraint = None;
        let mut short = None;
        for part in node.clone().into_inner() {
            match part.as_rule() {
                Rule::element_prefix => self.builder.add_prefix(&mut prefixes, &part),
                Rule::class_head => head = Some(self.builder.class_head(part)),
                Rule::long_class => return self.long_class(prefixes, head.unwrap_or_default(), part, span),
                Rule::short_class => short = Some(part),
                Rule::constraining => constraint = self.builder.constraint(part),
                Rule::component_clause => return self.component_clause(&node, prefixes, part, span),
                _ => {}
            }
        }
        let Some(short) = short else { return };
        self.builder.recovered = false;
        self.builder.check_terminator(&node, "this class definition");
        let class = self.builder.short_class(head.unwrap_or_default(), short, span);
        self.add_class(NestedClass { prefixes: prefixes.element, class, constrained_by: constraint });
    }

    fn component_clause(&mut self, node: &Node<'t>, prefixes: Prefixes, clause: Node<'t>, span: Span) {
        if self.open.is_empty() {
            return self.stray(node);
        }
        if self.builder.misspelt_head(node) {
            return;
        }
        self.builder.recovered = false;
        self.builder.check_terminator(node, "this declaration");
        let components = self.builder.components(clause, &prefixes, None, span.start);
        let Some(class) = self.open.last_mut() else { return };
        let protected = class.protected;
        class.elements.extend(components.into_iter().map(|mut component| {
            component.prefixes.protected = protected;
            Element::Component(component)
        }));
    }

    fn long_class(&mut self, prefixes: Prefixes, head: ClassHead, node: Node<'t>, start: Span) {
        self.builder.recovered = false;
        let mut name = None;
        let mut description = None;
        let mut extends_from = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::ident => name = Some(self.builder.ident(&part)),
                Rule::kw_extends => extends_from = Some(Modification::default()),
                Rule::class_modification => extends_from = Some(self.builder.class_modification(part)),
                Rule::description => description = self.builder.description(part),
                _ => {}
            }
        }
        let Some(name) = name else { return };
        self.check_class_place(&name);
        self.push(prefixes, head, name, start, false);
        if let Some(class) = self.open.last_mut() {
            class.description = description;
            class.extends_from = extends_from;
        }
    }

    /// A class that begins in an equation section: either the class around it lacks its `end`, or it stands too late.
    fn check_class_place(&mut self, name: &Ident) {
        while self.open.last().is_some_and(|class| class.in_code) {
            let Some(class) = self.open.last() else { return };
            let closed_later =
                self.builder.ends.get(&*class.name.name).is_some_and(|&at| at > name.span.start as usize);
            if closed_later {
                self.builder
                    .error(
                        name.span,
                        format!("the class `{}` cannot be declared in an equation or algorithm section", name.name),
                    )
                    .notes
                    .push("put it before `equation`".into());
                return;
            }
            if let Some(class) = self.open.pop() {
                let before = format!("before the class `{}`", name.name);
                self.not_closed(&class, &before, name.span);
                self.close(class, name.span);
            }
        }
    }

    fn not_closed(&mut self, class: &OpenClass, before: &str, at: Span) {
        if class.broken {
            return;
        }
        let name = &class.name.name;
        let diagnostic = Diagnostic::error(Code::Syntax, format!("`end {name};` is missing {before}"))
            .at(class.name.span, format!("the class `{name}` begins here"))
            .with(at, "it must end before this");
        self.builder.report(diagnostic);
    }

    fn class_end(&mut self, node: Node<'t>) {
        self.builder.recovered = false;
        let span = self.builder.trimmed_span(&node);
        let mut name = None;
        let mut constraint = None;
        let mut annotation = None;
        for part in node.clone().into_inner() {
            match part.as_rule() {
                Rule::ident => name = Some(self.builder.ident(&part)),
                Rule::constraining => constraint = self.builder.constraint(part),
                Rule::annotation => annotation = Some(self.builder.annotation(part)),
                _ => {}
            }
        }
        let _ = annotation;
        self.builder.check_terminator(&node, "the end of the class");
        if name.is_none() && self.builder.lost {
            return;
        }
        self.builder.lost = false;
        let Some(position) = self.find_class(name.as_ref(), span) else { return };
        while self.open.len() > position + 1 {
            let Some(inner) = self.open.pop() else { break };
            let before = name.as_ref().map_or_else(|| "here".to_string(), |n| format!("before `end {};`", n.name));
            self.not_closed(&inner, &before, span);
            self.close(inner, span);
        }
        if let Some(class) = self.open.pop() {
            self.close_with(class, span, constraint);
        }
    }

    /// The position of the class that `end name` closes, with a message if the name is wrong or missing.
    fn find_class(&mut self, name: Option<&Ident>, span: Span) -> Option<usize> {
        let Some(innermost) = self.open.last() else {
            let text = name.map_or_else(|| "end".to_string(), |n| format!("end {}", n.name));
            self.builder.error(span, format!("`{text}` closes nothing: no class is open here"));
            return None;
        };
        let Some(name) = name else {
            let message = format!("the name of the class is missing after `end`: `end {};`", innermost.name.name);
            let diagnostic = Diagnostic::error(Code::EndName, message).at(span, "");
            self.builder.report(diagnostic.with(innermost.name.span, "the class begins here"));
            return Some(self.open.len() - 1);
        };
        if let Some(position) = self.open.iter().rposition(|class| class.name.name == name.name) {
            return Some(position);
        }
        if !innermost.broken {
            let class = &innermost.name;
            let message = format!("the class is called `{}`, but its end says `{}`", class.name, name.name);
            let diagnostic = Diagnostic::error(Code::EndName, message)
                .at(name.span, "")
                .with(class.span, "the class begins here")
                .help(match did_you_mean(&name.name, [&*class.name]) {
                    Some(hint) => hint,
                    None => format!("write `end {};`", class.name),
                });
            self.builder.report(diagnostic);
        }
        Some(self.open.len() - 1)
    }

    fn close(&mut self, class: OpenClass, end: Span) {
        let end = Span { end: end.start.max(class.start.end), ..class.start };
        self.close_with(class, end, None);
    }

    fn close_with(&mut self, class: OpenClass, end: Span, constraint: Option<crate::tree::Constraint>) {
        if class.broken {
            return;
        }
        let definition = Arc::new(ClassDef {
            kind: class.head.kind,
            encapsulated: class.head.encapsulated,
            partial: class.head.partial,
            expandable: class.head.expandable,
            pure: class.head.pure,
            name: class.name,
            description: class.description,
            body: ClassBody::Long {
                elements: class.elements,
                equations: class.equations,
                algorithms: class.algorithms,
                external: class.external,
                extends_from: class.extends_from,
            },
            annotation: class.annotation,
            span: class.start.to(end),
        });
        self.add_class(NestedClass { prefixes: class.prefixes.element, class: definition, constrained_by: constraint });
    }

    fn add_class(&mut self, mut nested: NestedClass) {
        match self.open.last_mut() {
            Some(outer) => {
                nested.prefixes.protected = outer.protected;
                outer.elements.push(Element::Class(nested));
            }
            None => self.definition.classes.push(nested.class),
        }
    }

    fn finish(&mut self) {
        let end = Span::new(self.builder.file, self.builder.text.len(), self.builder.text.len());
        while let Some(class) = self.open.pop() {
            if !class.broken && !self.builder.truncated && !self.builder.gave_up {
                let name = &class.name.name;
                let message = format!("`end {name};` is missing at the end of the file");
                let diagnostic = Diagnostic::error(Code::Syntax, message);
                self.builder.report(diagnostic.at(class.name.span, format!("the class `{name}` begins here")));
            }
            self.close(class, end);
        }
    }
}

/// The spanned text with its blanks made single.
fn one_line(text: &str, span: Span) -> String {
    let part = text.get(span.start as usize..span.end as usize).unwrap_or("");
    part.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The part of a span on its first line.
fn first_line(text: &str, span: Span) -> Span {
    let part = text.get(span.start as usize..span.end as usize).unwrap_or("");
    let length = part.find('\n').unwrap_or(part.len());
    Span { end: span.start + part[..length].trim_end().len() as u32, ..span }
}
