//! The instance tree: components with their classes, sizes, modifications resolved, arrays kept as arrays.
//!
//! An array of components is one instance with sizes; what is inside it exists once and gets its subscripts from the
//! arrays around it.  That keeps the tree as small as the text.

use std::rc::Rc;
use std::sync::Arc;

use hyd_index::typed_index;
use hyd_source::Span;
use hyd_syntax::tree::{ClassKind, Direction, Name, Variability};
use rustc_hash::FxHashMap;

use crate::classes::class::ClassId;
use crate::classes::modifier::{Applied, Mods};
use crate::classes::shape::Shape;
use crate::instantiation::tree::Instances;
use crate::values::value::EnumType;

typed_index!(
    /// A component instance (an array of components is one instance).
    InstId,
    "inst"
);

/// Where names of an expression are looked up: in an instance, from one frame of its class.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct Scope {
    /// The instance.
    pub inst: InstId,
    /// The frame (see [`Shape`]) the text is written in.
    pub frame: u32,
}

/// The type of a scalar variable.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ScalarType {
    /// Real
    Real,
    /// Integer
    Integer,
    /// Boolean
    Boolean,
    /// String
    Text,
    /// An enumeration.
    Enumeration(Arc<EnumType>),
    /// An external object.
    Object,
    /// A clock (Modelica 3.6, section 16.2.1).
    Clock,
}

impl ScalarType {
    /// The predefined type of that name; Real for all others.
    pub fn of_builtin(name: &str) -> Self {
        match name {
            "Integer" => ScalarType::Integer,
            "Boolean" => ScalarType::Boolean,
            "String" => ScalarType::Text,
            "ExternalObject" => ScalarType::Object,
            "Clock" => ScalarType::Clock,
            other => match crate::instantiation::lookup::predefined_enumeration(other) {
                Some(enumeration) => ScalarType::Enumeration(enumeration),
                None => ScalarType::Real,
            },
        }
    }

    /// Name for messages.
    pub fn name(&self) -> &str {
        match self {
            ScalarType::Real => "Real",
            ScalarType::Integer => "Integer",
            ScalarType::Boolean => "Boolean",
            ScalarType::Text => "String",
            ScalarType::Enumeration(e) => &e.name,
            ScalarType::Object => "an external object",
            ScalarType::Clock => "Clock",
        }
    }
}

/// What a variable has beyond other instances.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Its type.
    pub scalar: ScalarType,
    /// Attributes that were given, each by its outermost modification.
    pub attributes: Vec<(Name, Applied)>,
    /// The binding, if any.
    pub binding: Option<Applied>,
    /// The binding is in the declaration itself or in a modification that says `final`.
    pub is_final: bool,
}

/// A class as an instance sees it.
#[derive(Clone, Debug)]
pub struct LocalClass {
    /// The class it is now.
    pub class: ClassId,
    /// Modifications that come with it, outermost first.
    pub mods: Mods,
    /// The instance it is an element of, where that is not a package: its constants and redeclared classes count for it.
    pub context: Option<InstId>,
}

impl LocalClass {
    /// A class that nothing is said of.
    pub fn plain(class: ClassId) -> Self {
        Self { class, mods: Mods::new(), context: None }
    }
}

/// A component.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name (of the root: empty).
    pub name: Name,
    /// What it is a component of.
    pub parent: Option<InstId>,
    /// Its class; `None` for predefined types.
    pub class: Option<ClassId>,
    /// The instance that its class is an element of, if any.
    pub context: Option<InstId>,
    /// Shape of the class.
    pub shape: Option<Rc<Shape>>,
    /// Kind of its class (`Type` for variables).
    pub kind: ClassKind,
    /// Own sizes.
    pub dims: Vec<usize>,
    /// Of an array whose elements differ: the instances of its elements, the last subscript fastest.  They are components of the
    /// parent, which the array itself is not.
    pub parts: Vec<InstId>,
    /// Of an element of such an array: the array, and its subscripts from 0.
    pub part_of: Option<(InstId, Vec<usize>)>,
    /// Components in the order of the text.
    pub children: Vec<InstId>,
    /// Components by name (an `outer` component is the `inner` one).
    pub by_name: FxHashMap<Name, InstId>,
    /// Components that are `inner` and `outer` at once: what is inside means them, the class itself means the one above (5.4.1).
    pub own_inner: FxHashMap<Name, InstId>,
    /// Local classes that were redeclared.
    pub local_classes: FxHashMap<Name, LocalClass>,
    /// Variability, that of the parents included.
    pub variability: Variability,
    /// `flow`
    pub flow: bool,
    /// `stream`
    pub stream: bool,
    /// An expandable connector.
    pub expandable: bool,
    /// A record declared `final`, or part of one: its values stay.
    pub final_record: bool,
    /// `input`/`output`
    pub direction: Option<Direction>,
    /// Declared in a protected section, or part of such a component.
    pub protected: bool,
    /// `inner`
    pub inner: bool,
    /// `annotation(Evaluate = true)`: conditions on it are decided at translation (Modelica 3.6, section 18.3).
    pub evaluate: bool,
    /// Its condition is false: it and its connections do not exist.
    pub absent: bool,
    /// Description string.
    pub description: Option<Name>,
    /// The declaration (its name).
    pub span: Span,
    /// For variables.
    pub primitive: Option<Primitive>,
    /// It could not be made; a message has been given.
    pub broken: bool,
}

impl Instance {
    /// A component of which nothing is known yet.
    pub(crate) fn new(name: Name, parent: Option<InstId>, span: Span) -> Self {
        Self {
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
            stream: false,
            expandable: false,
            final_record: false,
            direction: None,
            protected: false,
            inner: false,
            evaluate: false,
            absent: false,
            description: None,
            span,
            primitive: None,
            broken: false,
        }
    }

    /// True for an array, and for an element of one that is made for itself: values of modifications have its sizes in front.
    pub(crate) fn is_array(&self) -> bool {
        !self.dims.is_empty() || self.part_of.is_some()
    }
}

/// Full dotted path of an instance without subscripts, `""` for the root.
pub fn path(instances: &Instances, id: InstId) -> String {
    let mut names = Vec::new();
    let mut current = Some(id);
    while let Some(inst) = current {
        if !instances[inst].name.is_empty() {
            names.push(instances[inst].name.clone());
        }
        current = instances[inst].parent;
    }
    names.reverse();
    names.join(".")
}

/// The instance and its parents, from the top down.
pub fn chain(instances: &Instances, id: InstId) -> Vec<InstId> {
    let mut chain = vec![id];
    while let Some(parent) = instances[chain[chain.len() - 1]].parent {
        chain.push(parent);
    }
    chain.reverse();
    chain
}

/// Sizes of the arrays around an instance and its own, outermost first.
pub fn full_dims(instances: &Instances, id: InstId) -> Vec<usize> {
    chain(instances, id).iter().flat_map(|&i| instances[i].dims.iter().copied()).collect()
}
