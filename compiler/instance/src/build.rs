//! Instantiation: from a class and its modifications to the instance tree.
//!
//! For every component: gather the modifications that speak of it (outermost first), replace its class if it is
//! redeclared, evaluate its condition and sizes, then do the same inside (Modelica 3.6, sections 5.6 and 7).

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;

use hyd_index::IndexVec;
use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassKind, Component, Element, Expr, Name, Variability};
use rustc_hash::FxHashMap;

use crate::class::{ClassId, ClassTable, elements};
use crate::connection_rules::ConnectionRules;
use crate::constructor::Input;
use crate::instance::{InstId, Instance, Instances, Known, LocalClass, Scope};
use crate::modifier::{Applied, Mods, Redeclare, of_child, redeclaration};
use crate::shape::{Shape, ShapeElement};
use crate::value::{EnumType, Value};

/// A value set from outside by instance path.
#[derive(Clone, Debug)]
pub struct Override {
    /// Instance path.
    pub path: String,
    /// The value as it was written; its type says what it means.
    pub text: String,
    /// It was needed at translation.
    pub used: bool,
}

/// The instance tree with all that is needed to ask it further questions.
pub struct InstanceTree<'s> {
    /// Classes, texts and messages.
    pub table: ClassTable<'s>,
    /// All instances.
    pub instances: Instances,
    /// The top model.
    pub root: InstId,
    /// Values set from outside.
    pub overrides: Vec<Override>,
    /// What declarations say of connections.
    pub connection_rules: BTreeMap<InstId, ConnectionRules>,
    pub(crate) packages: FxHashMap<(ClassId, Option<InstId>), InstId>,
    pub(crate) enumerations: FxHashMap<ClassId, Option<Arc<EnumType>>>,
    /// Arguments of the constructors of records.
    pub(crate) constructors: FxHashMap<(ClassId, Option<InstId>), Rc<[Input]>>,
    /// Names of functions of the language that were looked for around a class and its text.
    pub(crate) declared_names: FxHashMap<(ClassId, ClassId, Name), bool>,
    pub(crate) depth: usize,
    /// Values being computed, with the places that ask for them.
    pub(crate) open_values: Vec<(InstId, Span)>,
    /// Expressions being evaluated, one within the other.
    pub(crate) evaluating: usize,
    /// Parameters that were asked for only as a guess, while a guess is computed.
    pub(crate) guessed: Option<Vec<InstId>>,
    /// Work of computing values so far.
    pub(crate) work: u64,
    /// Modifications from outside of the instances whose components are being made.
    pub(crate) pending: FxHashMap<InstId, Mods>,
    /// There are more components than there may be, and that has been said.
    pub(crate) too_many: bool,
    /// Arrays of components, by path, that are made element by element, and those that would have to be.
    pub(crate) apart: BTreeSet<String>,
    pub(crate) differing: BTreeSet<String>,
    /// Values of modifications of such arrays, by the place of their texts, which are kept with them.
    pub(crate) values_for_parts: FxHashMap<(usize, Scope), (Arc<Expr>, Value)>,
}

/// Instantiates a model.  `Err` gives the table back with its messages.
pub fn instantiate<'s>(
    table: ClassTable<'s>,
    class: ClassId,
    overrides: Vec<Override>,
) -> Result<InstanceTree<'s>, Box<ClassTable<'s>>> {
    instantiate_apart(table, class, overrides, BTreeSet::new())
}

/// The same with the arrays of components at these paths made element by element (see [`InstanceTree::differing`]).
pub fn instantiate_apart<'s>(
    table: ClassTable<'s>,
    class: ClassId,
    overrides: Vec<Override>,
    apart: BTreeSet<String>,
) -> Result<InstanceTree<'s>, Box<ClassTable<'s>>> {
    let mut tree = InstanceTree {
        table,
        instances: IndexVec::new(),
        root: InstId(0),
        overrides,
        connection_rules: BTreeMap::new(),
        packages: FxHashMap::default(),
        enumerations: FxHashMap::default(),
        constructors: FxHashMap::default(),
        declared_names: FxHashMap::default(),
        depth: 0,
        open_values: Vec::new(),
        evaluating: 0,
        guessed: None,
        work: 0,
        pending: FxHashMap::default(),
        too_many: false,
        apart,
        differing: BTreeSet::new(),
        values_for_parts: FxHashMap::default(),
    };
    let def = tree.table.class(class).def.clone();
    if !matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class) {
        let kind = def.kind.keyword();
        let message = format!("`{}` is a {kind} and cannot be simulated", tree.table.full_name(class));
        tree.table.report(
            Diagnostic::error(Code::Misplaced, message)
                .at(def.name.span, "declared here")
                .help("a model or a block can be"),
        );
        return Err(Box::new(tree.table));
    }
    if def.partial {
        let message = format!("`{}` is partial and cannot be simulated by itself", tree.table.full_name(class));
        tree.table.report(Diagnostic::error(Code::PartialClass, message).at(def.name.span, "declared partial here"));
        return Err(Box::new(tree.table));
    }
    let Ok(shape) = tree.table.shape(class) else { return Err(Box::new(tree.table)) };
    let root = tree.new_instance("".into(), None, def.name.span);
    tree.root = root;
    let instance = &mut tree.instances[root];
    instance.class = Some(class);
    instance.shape = Some(shape);
    instance.kind = def.kind;
    instance.description = def.description.clone();
    let _ = tree.instantiate_members(root, &Vec::new(), 0);
    tree.name_parts_in_bindings();
    if tree.too_many { Err(Box::new(tree.table)) } else { Ok(tree) }
}

impl InstanceTree<'_> {
    /// The answer to a question whose messages are not meant for anybody.
    pub fn quietly<T>(&mut self, question: impl FnOnce(&mut Self) -> T) -> T {
        self.table.messages.begin();
        let answer = question(self);
        self.table.messages.end();
        answer
    }

    pub(crate) fn new_instance(&mut self, name: Name, parent: Option<InstId>, span: Span) -> InstId {
        self.instances.push(Instance {
            name,
            parent,
            class: None,
            context: None,
            shape: None,
            kind: ClassKind::Type,
            dims: Vec::new(),
            parts: Vec::new(),
            part_of: None,
            children: Vec::new(),
            by_name: FxHashMap::default(),
            own_inner: FxHashMap::default(),
            local_classes: FxHashMap::default(),
            variability: Variability::Continuous,
            flow: false,
            direction: None,
            protected: false,
            inner: false,
            absent: false,
            description: None,
            span,
            primitive: None,
            known: Known::No,
        })
    }

    /// The instance that holds the constants of a package, of a function or of a type.
    pub(crate) fn package_instance(&mut self, local: &LocalClass) -> Result<InstId, Reported> {
        let LocalClass { class, context, .. } = *local;
        if let Some(&known) = self.packages.get(&(class, context)) {
            return Ok(known);
        }
        let shape = self.table.shape(class)?;
        let def = self.table.class(class).def.clone();
        let inst = self.new_instance(self.table.full_name(class).into(), None, def.name.span);
        self.instances[inst].class = Some(class);
        self.instances[inst].context = context;
        self.instances[inst].shape = Some(shape);
        self.instances[inst].kind = ClassKind::Package;
        let shape = self.table.shape(class)?;
        if shape.builtin.is_none() {
            self.check_targets(inst, &shape, &Mods::new(), 0);
        }
        self.packages.insert((class, context), inst);
        Ok(inst)
    }

    /// A scope for the text of a class that is not instantiated (a function): its constants and enclosing packages.
    pub fn package_of(&mut self, local: &LocalClass) -> Result<InstId, Reported> {
        self.package_instance(local)
    }

    /// Makes all components of an instance whose class is set.  Errors are reported; the rest is still made.
    /// The first `outside` modifications stand outside of the class: they cannot reach protected elements.
    pub(crate) fn instantiate_members(&mut self, inst: InstId, mods: &Mods, outside: usize) -> Result<(), Reported> {
        let Some(shape) = self.instances[inst].shape.clone() else { return Ok(()) };
        self.check_targets(inst, &shape, mods, outside);
        for (k, element) in shape.elements.iter().enumerate() {
            if !element.component {
                self.redeclare_class(inst, &shape, k, mods);
            }
        }
        self.pending.insert(inst, mods.clone());
        let mut result = Ok(());
        for (k, element) in shape.elements.iter().enumerate() {
            // Some were named by those before and are made already.
            let open = element.component && !self.instances[inst].by_name.contains_key(&element.name);
            if open && self.instantiate_element(inst, k, mods).is_err() {
                result = Err(Reported);
            }
        }
        self.pending.remove(&inst);
        self.order_children(inst);
        result
    }

    /// All modifications of element `k`, outermost first: from outside, from `extends` clauses, from the declaration.
    pub(crate) fn mods_of(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize, outer: &Mods) -> Mods {
        let element = &shape.elements[k];
        let array = self.instances[inst].is_array().then_some(inst);
        let mut mods = of_child(outer, &element.name, array);
        for (frame, tree) in &shape.frames[element.frame as usize].modifications {
            let scope = Scope { inst, frame: *frame };
            let applied = Applied { tree: tree.clone(), scope, spread: Vec::new() };
            mods.extend(of_child(&vec![applied], &element.name, None));
        }
        mods
    }

    pub(crate) fn declared(&self, shape: &Shape, element: &ShapeElement) -> Option<Component> {
        let class = shape.frames[element.frame as usize].class;
        match &elements(&self.table.class(class).def)[element.position as usize] {
            Element::Component(component) => Some(component.clone()),
            _ => None,
        }
    }

    /// True where the class that has a component declares it protected, whatever is around that.
    pub fn is_declared_protected(&self, inst: InstId) -> bool {
        let instance = &self.instances[inst];
        let shape = instance.parent.and_then(|parent| self.instances[parent].shape.as_ref());
        let Some((shape, &k)) = shape.and_then(|shape| Some((shape, shape.by_name.get(&instance.name)?))) else {
            return false;
        };
        let element = &shape.elements[k as usize];
        let frame = &shape.frames[element.frame as usize];
        let declared = &elements(&self.table.class(frame.class).def)[element.position as usize];
        frame.protected || matches!(declared, Element::Component(component) if component.prefixes.protected)
    }

    /// Makes component `k` of the instance's shape.
    pub(crate) fn instantiate_element(&mut self, inst: InstId, k: usize, outer: &Mods) -> Result<(), Reported> {
        let Some(shape) = self.instances[inst].shape.clone() else { return Ok(()) };
        let element = &shape.elements[k];
        self.limit_components(inst, &shape, element)?;
        let Some(mut declaration) = self.declared(&shape, element) else { return Ok(()) };
        let original_span = declaration.name.span;
        let own_scope = Scope { inst, frame: element.frame };
        let mut type_scope = own_scope;
        let mut mods = self.mods_of(inst, &shape, k, outer);
        if let Some((position, applied)) = redeclaration(&mods).map(|(p, a)| (p, a.clone())) {
            let Some(Redeclare::Component(new)) = &applied.tree.redeclare else {
                let message = format!("`{}` is a component and is redeclared as a class", element.name);
                self.table.report(
                    Diagnostic::error(Code::Redeclaration, message)
                        .at(applied.tree.span.unwrap_or(original_span), "")
                        .with(original_span, "declared here"),
                );
                return Err(Reported);
            };
            if !declaration.prefixes.replaceable {
                self.table.not_replaceable(&element.name, applied.tree.span, original_span);
                return Err(Reported);
            }
            // 7.3.2: the modification of the constraining clause stays in force, else that of the declaration.
            let kept = match &declaration.constrained_by {
                Some(constraint) => Arc::new(crate::modifier::AstMod::from_syntax(&constraint.modification)),
                None => element.modification.clone(),
            };
            let tree = Arc::new(crate::modifier::AstMod::from_syntax(&new.modification));
            if let Some(first) = mods[position + 1..].iter().find(|m| m.tree.redeclare.is_some() && m.tree.is_final) {
                let declared = first.tree.span;
                self.final_modified(&element.name, applied.tree.span, declared);
            }
            let wanted = declaration.constrained_by.as_ref().map_or(&declaration.class, |c| &c.base);
            self.check_redeclared(own_scope, wanted, &applied, new)?;
            mods.truncate(position);
            mods.push(Applied { tree, scope: applied.scope, spread: applied.spread.clone() });
            mods.push(Applied { tree: kept, scope: own_scope, spread: Vec::new() });
            type_scope = applied.scope;
            declaration = Component {
                prefixes: declaration.prefixes.clone(),
                condition: declaration.condition.clone(),
                dims: if new.dims.is_empty() { declaration.dims.clone() } else { new.dims.clone() },
                description: new.description.clone().or(declaration.description.clone()),
                annotation: new.annotation.clone().or(declaration.annotation.clone()),
                ..(**new).clone()
            };
        } else {
            mods.push(Applied { tree: element.modification.clone(), scope: own_scope, spread: Vec::new() });
            if let Some(kept) = self.kept_of_replaced(inst, &shape, element) {
                mods.push(kept);
            }
            if let Some(constraint) = &declaration.constrained_by {
                let tree = Arc::new(crate::modifier::AstMod::from_syntax(&constraint.modification));
                mods.push(Applied { tree, scope: own_scope, spread: Vec::new() });
            }
        }
        self.check_final(&element.name, &mods, declaration.prefixes.is_final);
        let made = self.make(inst, element, &declaration, own_scope, type_scope, mods);
        if made.is_err() {
            self.broken(inst, &element.name, declaration.name.span);
        }
        made
    }

    /// What a declaration said of the element that a `redeclare` element of this class or a base replaces (7.3.2).
    fn kept_of_replaced(&mut self, inst: InstId, shape: &Shape, element: &ShapeElement) -> Option<Applied> {
        let (frame, position) = element.replaced?;
        let owner = self.table.class(shape.frames[frame as usize].class).def.clone();
        let Element::Component(original) = &elements(&owner)[position as usize] else { return None };
        let modification = match &original.constrained_by {
            Some(constraint) => &constraint.modification,
            None => &original.modification,
        };
        let mut tree = crate::modifier::AstMod::from_syntax(modification);
        tree.is_final = false;
        Some(Applied { tree: Arc::new(tree), scope: Scope { inst, frame }, spread: Vec::new() })
    }

    fn check_final(&mut self, name: &str, mods: &Mods, declared_final: bool) {
        let last = mods.len() - 1;
        for (inner, applied) in mods.iter().enumerate().skip(1) {
            let is_final = applied.tree.is_final || (inner == last && declared_final);
            let Some(outer) = mods[..inner].iter().find(|m| m.tree.binding.is_some() || !m.tree.children.is_empty())
            else {
                continue;
            };
            if is_final {
                self.final_modified(name, outer.tree.span, applied.tree.span);
                return;
            }
        }
    }

    pub(crate) fn final_modified(&mut self, name: &str, at: Option<Span>, declared: Option<Span>) {
        let message = format!("`{name}` is final and cannot be modified");
        let mut diagnostic = Diagnostic::error(Code::FinalModified, message);
        if let Some(span) = at {
            diagnostic = diagnostic.at(span, "modified here");
        }
        if let Some(span) = declared {
            diagnostic = diagnostic.with(span, "declared final here");
        }
        self.table.report(diagnostic);
    }
}
