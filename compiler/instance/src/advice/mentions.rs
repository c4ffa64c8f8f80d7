//! Which names a class mentions, and whether they are read or only set.
//!
//! A mention is the first identifier of a reference, of a class name or of a modified element, wherever it stands: in
//! declarations, equations, statements, annotations and nested classes.

use hyd_syntax::tree::{
    Argument, Arguments, ClassBody, ClassDef, Component, ComponentRef, Constraint, Element, Equation, EquationKind,
    Expr, ExprKind, Iterator, Modification, Name, NestedClass, Path, Statement, StatementKind,
};
use rustc_hash::FxHashMap;

/// How often a name is read, and how often it is only the target of `name := value`.
#[derive(Clone, Copy, Default, Debug)]
pub struct Uses {
    /// Mentions that need the value or the meaning of the name.
    pub read: u32,
    /// Assignments to it.
    pub set: u32,
}

/// The names that a text mentions.
#[derive(Default, Debug)]
pub struct Mentions {
    uses: FxHashMap<Name, Uses>,
}

impl Mentions {
    /// How a name is used.
    pub fn of(&self, name: &Name) -> Uses {
        self.uses.get(name).copied().unwrap_or_default()
    }

    /// True if the name occurs.
    pub fn has(&self, name: &Name) -> bool {
        self.uses.contains_key(name)
    }

    /// Takes over what a nested class mentions.
    pub fn merge(&mut self, inner: &Mentions) {
        for (name, uses) in &inner.uses {
            let mine = self.uses.entry(name.clone()).or_default();
            mine.read += uses.read;
            mine.set += uses.set;
        }
    }

    /// What a class mentions outside its nested classes, apart from import clauses.
    pub fn add_class(&mut self, def: &ClassDef) {
        self.maybe_modification(def.annotation.as_ref());
        match &def.body {
            ClassBody::Long { elements, equations, algorithms, extends_from, .. } => {
                self.maybe_modification(extends_from.as_ref());
                elements.iter().for_each(|element| self.element(element));
                equations.iter().flat_map(|section| &section.equations).for_each(|e| self.equation(e));
                algorithms.iter().flat_map(|section| &section.statements).for_each(|s| self.statement(s));
            }
            ClassBody::Short { base, dims, modification, .. } => {
                self.path(base);
                dims.iter().for_each(|e| self.expr(e));
                self.modification(modification);
            }
            ClassBody::Enumeration(_) => {}
            ClassBody::DerivativeOf(path, _) => self.path(path),
        }
    }

    fn read(&mut self, name: &Name) {
        self.uses.entry(name.clone()).or_default().read += 1;
    }

    fn path(&mut self, path: &Path) {
        if let (false, Some(first)) = (path.global, path.parts.first()) {
            self.read(&first.name);
        }
    }

    fn element(&mut self, element: &Element) {
        match element {
            Element::Import(_) => {}
            Element::Extends(extends) => {
                self.path(&extends.base);
                self.modification(&extends.modification);
                self.maybe_modification(extends.annotation.as_ref());
            }
            Element::Class(nested) => self.constraint(nested.constrained_by.as_ref()),
            Element::Component(component) => self.component(component),
        }
    }

    fn constraint(&mut self, constraint: Option<&Constraint>) {
        if let Some(constraint) = constraint {
            self.path(&constraint.base);
            self.modification(&constraint.modification);
        }
    }

    fn component(&mut self, component: &Component) {
        self.path(&component.class);
        component.dims.iter().chain(&component.condition).for_each(|e| self.expr(e));
        self.modification(&component.modification);
        self.constraint(component.constrained_by.as_ref());
        self.maybe_modification(component.annotation.as_ref());
    }

    fn maybe_modification(&mut self, modification: Option<&Modification>) {
        if let Some(modification) = modification {
            self.modification(modification);
        }
    }

    fn modification(&mut self, modification: &Modification) {
        modification.binding.iter().for_each(|e| self.expr(e));
        for argument in &modification.arguments {
            match argument {
                Argument::Modify(inner) => {
                    self.path(&inner.target);
                    self.modification(&inner.modification);
                }
                Argument::RedeclareComponent { component, .. } => {
                    self.read(&component.name.name);
                    self.component(component);
                }
                Argument::RedeclareClass { class, .. } => self.redeclared(class),
            }
        }
    }

    fn redeclared(&mut self, class: &NestedClass) {
        self.read(&class.class.name.name);
        self.constraint(class.constrained_by.as_ref());
        self.add_class(&class.class);
    }

    fn reference(&mut self, reference: &ComponentRef) {
        if let (false, Some(first)) = (reference.global, reference.parts.first()) {
            self.read(&first.name.name);
        }
        self.subscripts(reference);
    }

    fn subscripts(&mut self, reference: &ComponentRef) {
        reference.parts.iter().flat_map(|part| &part.subscripts).for_each(|e| self.expr(e));
    }

    fn arguments(&mut self, arguments: &Arguments) {
        match arguments {
            Arguments::List { positional, named } => {
                positional.iter().chain(named.iter().map(|(_, e)| e)).for_each(|e| self.expr(e));
            }
            Arguments::Reduction(body, iterators) => {
                self.expr(body);
                self.iterators(iterators);
            }
        }
    }

    fn iterators(&mut self, iterators: &[Iterator]) {
        iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Ref(reference) => self.reference(reference),
            ExprKind::Call(function, arguments) => {
                self.reference(function);
                self.arguments(arguments);
            }
            ExprKind::Unary(_, a) | ExprKind::Field(a, _) => self.expr(a),
            ExprKind::Binary(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::If(branches, otherwise) => {
                branches.iter().flat_map(|(c, v)| [c, v]).for_each(|e| self.expr(e));
                self.expr(otherwise);
            }
            ExprKind::Range(a, step, b) => {
                self.expr(a);
                step.iter().for_each(|e| self.expr(e));
                self.expr(b);
            }
            ExprKind::ArrayFor(body, iterators) => {
                self.expr(body);
                self.iterators(iterators);
            }
            ExprKind::Array(items) => items.iter().for_each(|e| self.expr(e)),
            ExprKind::Matrix(rows) => rows.iter().flatten().for_each(|e| self.expr(e)),
            ExprKind::Tuple(items) => items.iter().flatten().for_each(|e| self.expr(e)),
            ExprKind::Integer(_)
            | ExprKind::Real(_)
            | ExprKind::Text(_)
            | ExprKind::Boolean(_)
            | ExprKind::Colon
            | ExprKind::End => {}
        }
    }

    fn equation(&mut self, equation: &Equation) {
        match &equation.kind {
            EquationKind::Equal(a, b) => {
                self.expr(a);
                self.expr(b);
            }
            EquationKind::Connect(a, b) => {
                self.reference(a);
                self.reference(b);
            }
            EquationKind::For(iterators, body) => {
                self.iterators(iterators);
                body.iter().for_each(|e| self.equation(e));
            }
            EquationKind::If(branches) => {
                for (condition, body) in branches {
                    condition.iter().for_each(|e| self.expr(e));
                    body.iter().for_each(|e| self.equation(e));
                }
            }
            EquationKind::When(branches) => {
                for (condition, body) in branches {
                    self.expr(condition);
                    body.iter().for_each(|e| self.equation(e));
                }
            }
            EquationKind::Call(function, arguments) => {
                self.reference(function);
                self.arguments(arguments);
            }
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Assign(target, value) => {
                if let (false, Some(first)) = (target.global, target.parts.first()) {
                    self.uses.entry(first.name.name.clone()).or_default().set += 1;
                }
                self.subscripts(target);
                self.expr(value);
            }
            StatementKind::AssignTuple(targets, function, arguments) => {
                // Of several results some are often taken only because of their place.
                targets.iter().flatten().for_each(|target| self.reference(target));
                self.reference(function);
                self.arguments(arguments);
            }
            StatementKind::Call(function, arguments) => {
                self.reference(function);
                self.arguments(arguments);
            }
            StatementKind::If(branches) => {
                for (condition, body) in branches {
                    condition.iter().for_each(|e| self.expr(e));
                    self.statements(body);
                }
            }
            StatementKind::For(iterators, body) => {
                self.iterators(iterators);
                self.statements(body);
            }
            StatementKind::While(condition, body) => {
                self.expr(condition);
                self.statements(body);
            }
            StatementKind::When(branches) => {
                for (condition, body) in branches {
                    self.expr(condition);
                    self.statements(body);
                }
            }
            StatementKind::Break | StatementKind::Return => {}
        }
    }

    fn statements(&mut self, statements: &[Statement]) {
        statements.iter().for_each(|statement| self.statement(statement));
    }
}
