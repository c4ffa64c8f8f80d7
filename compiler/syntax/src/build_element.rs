//! Elements of a class: prefixes, imports, `extends`, short classes and component declarations.
//!
//! `Real x[3], y` gives two components.  The order of the prefixes is that of the Modelica grammar (3.6, appendix A.2.3);
//! another order is reported, and read as meant.

use std::sync::Arc;

use hyd_source::Span;

use crate::build::Builder;
use crate::grammar::{Node, Rule};
use crate::tree::{
    ClassBody, ClassDef, ClassKind, Component, Constraint, Direction, ElementPrefixes, EnumLiteral, Expr, Extends,
    Ident, Import, ImportKind, Modification, Name, Path, Variability,
};

/// All prefixes of a component or class, in any order.
#[derive(Clone, Debug)]
pub(crate) struct Prefixes {
    pub(crate) element: ElementPrefixes,
    pub(crate) flow: bool,
    pub(crate) stream: bool,
    pub(crate) variability: Variability,
    pub(crate) direction: Option<Direction>,
    last: Option<(u8, String)>,
}

impl Default for Prefixes {
    fn default() -> Self {
        Self {
            element: ElementPrefixes::default(),
            flow: false,
            stream: false,
            variability: Variability::Continuous,
            direction: None,
            last: None,
        }
    }
}

/// The words before the name of a class.
#[derive(Clone, Debug)]
pub(crate) struct ClassHead {
    pub(crate) kind: ClassKind,
    pub(crate) encapsulated: bool,
    pub(crate) partial: bool,
    pub(crate) expandable: bool,
    pub(crate) pure: Option<bool>,
}

impl Default for ClassHead {
    fn default() -> Self {
        Self { kind: ClassKind::Class, encapsulated: false, partial: false, expandable: false, pure: None }
    }
}

impl<'t> Builder<'t> {
    /// Adds an `element_prefix` and checks its place.
    pub(crate) fn add_prefix(&mut self, prefixes: &mut Prefixes, node: &Node<'t>) {
        let word = node.as_str();
        let rank = match word {
            "redeclare" => 0,
            "final" => 1,
            "inner" => 2,
            "outer" => 3,
            "replaceable" => 4,
            "flow" | "stream" => 5,
            "discrete" | "parameter" | "constant" => 6,
            _ => 7,
        };
        if let Some((before, other)) = prefixes.last.take().filter(|(before, _)| *before >= rank) {
            let span = self.span(node);
            let message = match before == rank {
                true if other == word => format!("`{word}` stands here twice"),
                true => format!("`{other}` and `{word}` exclude each other"),
                false => format!("`{word}` must stand before `{other}`"),
            };
            self.error(span, message);
        }
        prefixes.last = Some((rank, word.to_string()));
        match word {
            "redeclare" => prefixes.element.redeclare = true,
            "final" => prefixes.element.is_final = true,
            "inner" => prefixes.element.inner = true,
            "outer" => prefixes.element.outer = true,
            "replaceable" => prefixes.element.replaceable = true,
            "flow" => prefixes.flow = true,
            "stream" => prefixes.stream = true,
            "discrete" => prefixes.variability = Variability::Discrete,
            "parameter" => prefixes.variability = Variability::Parameter,
            "constant" => prefixes.variability = Variability::Constant,
            "input" => prefixes.direction = Some(Direction::Input),
            _ => prefixes.direction = Some(Direction::Output),
        }
    }

    /// A `class_head` node.
    pub(crate) fn class_head(&mut self, node: Node<'t>) -> ClassHead {
        let span = self.span(&node);
        let mut head = ClassHead::default();
        let mut kind = None;
        let mut operator = false;
        for word in node.into_inner() {
            let next = match word.as_str() {
                "encapsulated" => {
                    head.encapsulated = true;
                    continue;
                }
                "partial" => {
                    head.partial = true;
                    continue;
                }
                "expandable" => {
                    head.expandable = true;
                    continue;
                }
                "pure" => {
                    head.pure = Some(true);
                    continue;
                }
                "impure" => {
                    head.pure = Some(false);
                    continue;
                }
                "operator" => {
                    operator = true;
                    continue;
                }
                "class" => ClassKind::Class,
                "model" => ClassKind::Model,
                "block" => ClassKind::Block,
                "connector" => ClassKind::Connector,
                "record" => ClassKind::Record,
                "type" => ClassKind::Type,
                "package" => ClassKind::Package,
                _ => ClassKind::Function,
            };
            kind = Some(next);
        }
        match (kind, operator) {
            (None, true) => head.kind = ClassKind::Operator,
            (Some(kind), _) => head.kind = kind,
            (None, _) => {
                self.error(span, "the kind of the class is missing: `model`, `block`, `connector`, `record`, `type`, `package` or `function`");
            }
        }
        head
    }

    /// A `short_class` node; `whole` is the span of the definition with its prefixes.
    pub(crate) fn short_class(&mut self, head: ClassHead, node: Node<'t>, whole: Span) -> Arc<ClassDef> {
        let mut name = None;
        let mut body = None;
        let mut description = None;
        let mut annotation = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::ident => name = Some(self.ident(&part)),
                Rule::enumeration => body = Some(self.enumeration(part)),
                Rule::derivative => body = self.derivative(part),
                Rule::short_base => body = self.short_base(part),
                Rule::description => description = self.description(part),
                Rule::annotation => annotation = Some(self.annotation(part)),
                _ => {}
            }
        }
        let name = name.unwrap_or(Ident { name: Arc::from(""), span: whole });
        Arc::new(ClassDef {
            kind: head.kind,
            encapsulated: head.encapsulated,
            partial: head.partial,
            expandable: head.expandable,
            pure: head.pure,
            name,
            description,
            body: body.unwrap_or(ClassBody::Enumeration(None)),
            annotation,
            span: whole,
        })
    }

    fn enumeration(&mut self, node: Node<'t>) -> ClassBody {
        let mut literals = Vec::new();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::all_colon => return ClassBody::Enumeration(None),
                Rule::literal => literals.extend(self.literal(part)),
                _ => {}
            }
        }
        ClassBody::Enumeration(Some(literals))
    }

    fn literal(&mut self, node: Node<'t>) -> Option<EnumLiteral> {
        let mut parts = node.into_inner();
        let name = parts.next().map(|n| self.ident(&n))?;
        let description = parts.find(|n| n.as_rule() == Rule::description).and_then(|n| self.description(n));
        Some(EnumLiteral { name, description })
    }

    fn derivative(&mut self, node: Node<'t>) -> Option<ClassBody> {
        let mut function = None;
        let mut variables = Vec::new();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::path => function = Some(self.path(part)),
                Rule::ident => variables.push(self.ident(&part)),
                _ => {}
            }
        }
        Some(ClassBody::DerivativeOf(function?, variables))
    }

    fn short_base(&mut self, node: Node<'t>) -> Option<ClassBody> {
        let mut prefixes = Prefixes::default();
        let mut base = None;
        let mut dims = Vec::new();
        let mut modification = Modification::default();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::element_prefix => {
                    if !matches!(part.as_str(), "input" | "output" | "flow") {
                        let span = self.span(&part);
                        self.error(span, format!("`{}` cannot stand in a short class definition", part.as_str()));
                    }
                    self.add_prefix(&mut prefixes, &part);
                }
                Rule::path => base = Some(self.path(part)),
                Rule::subscripts => dims = self.subscripts(part),
                Rule::class_modification => modification = self.class_modification(part),
                _ => {}
            }
        }
        Some(ClassBody::Short { direction: prefixes.direction, flow: prefixes.flow, base: base?, dims, modification })
    }

    /// A `component_clause` or `redeclared_component` node; `start` is the offset of the first prefix.
    pub(crate) fn components(
        &mut self,
        node: Node<'t>,
        prefixes: &Prefixes,
        constraint: Option<Constraint>,
        start: u32,
    ) -> Vec<Component> {
        let mut class = None;
        let mut type_dims = Vec::new();
        let mut declarations = Vec::new();
        let mut constraint = constraint;
        let (mut description, mut annotation) = (None, None);
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::path => class = Some(self.path(part)),
                Rule::subscripts => type_dims = self.subscripts(part),
                Rule::declaration => declarations.push(part),
                Rule::constraining => constraint = self.constraint(part),
                // What follows the constraint belongs to the declarations before it.
                Rule::description => description = self.description(part),
                Rule::annotation => annotation = Some(self.annotation(part)),
                _ => {}
            }
        }
        let Some(class) = class else { return Vec::new() };
        let mut components = Vec::with_capacity(declarations.len());
        for (k, part) in declarations.into_iter().enumerate() {
            let mut span = self.span(&part);
            if k == 0 {
                span.start = start;
            }
            components.extend(self.declaration(part, prefixes, &class, &type_dims, span));
        }
        for component in &mut components {
            component.constrained_by.clone_from(&constraint);
            component.description = component.description.take().or_else(|| description.clone());
            component.annotation = component.annotation.take().or_else(|| annotation.clone());
        }
        components
    }

    fn declaration(
        &mut self,
        node: Node<'t>,
        prefixes: &Prefixes,
        class: &Path,
        type_dims: &[Expr],
        span: Span,
    ) -> Option<Component> {
        let mut name = None;
        let mut dims = Vec::new();
        let mut modification = Modification::default();
        let mut condition = None;
        let mut description: Option<Name> = None;
        let mut annotation = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::ident => name = Some(self.ident(&part)),
                Rule::subscripts => dims = self.subscripts(part),
                Rule::modification => modification = self.modification(part),
                Rule::condition => condition = self.expressions(part).pop(),
                Rule::description => description = self.description(part),
                Rule::annotation => annotation = Some(self.annotation(part)),
                _ => {}
            }
        }
        dims.extend_from_slice(type_dims);
        Some(Component {
            prefixes: prefixes.element.clone(),
            flow: prefixes.flow,
            stream: prefixes.stream,
            variability: prefixes.variability,
            direction: prefixes.direction,
            class: class.clone(),
            dims,
            name: name?,
            modification,
            condition,
            constrained_by: None,
            description,
            annotation,
            span,
        })
    }

    /// An `import` node.
    pub(crate) fn import(&mut self, node: Node<'t>) -> Option<Import> {
        let span = self.trimmed_span(&node);
        let mut path = None;
        let mut what = ImportKind::Qualified;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::ident => what = ImportKind::Renamed(self.ident(&part)),
                Rule::path => path = Some(self.path(part)),
                Rule::star => what = ImportKind::All,
                Rule::import_list => {
                    let names = part.into_inner().filter(|n| n.as_rule() == Rule::ident);
                    what = ImportKind::Several(names.map(|n| self.ident(&n)).collect());
                }
                _ => {}
            }
        }
        Some(Import { path: path?, what, span })
    }

    /// An `extends` node.
    pub(crate) fn extends(&mut self, node: Node<'t>, protected: bool) -> Option<Extends> {
        let span = self.trimmed_span(&node);
        let mut base = None;
        let mut modification = Modification::default();
        let mut annotation = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::path => base = Some(self.path(part)),
                Rule::class_modification => modification = self.class_modification(part),
                Rule::annotation => annotation = Some(self.annotation(part)),
                _ => {}
            }
        }
        Some(Extends { base: base?, modification, protected, annotation, span })
    }
}
