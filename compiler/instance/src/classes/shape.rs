//! The shape of a class: its elements and equations with those of its base classes, in one list.
//!
//! Computed once per class and shared by all its instances.  Every base class is a *frame*: names in a declaration are
//! looked up among the elements of the frame it was written in and of that frame's own bases (Modelica 3.6, section 7.1).

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassBody, ClassDef, ClassKind, Element, Ident, Modification, Name};
use rustc_hash::FxHashMap;

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::modifier::AstMod;

/// How the classes on the way to a base were reached.
#[derive(Clone, Copy)]
struct Way<'w> {
    /// Modifications of the `extends` clauses, innermost last.
    outer: &'w [(u32, Arc<AstMod>)],
    /// One of them is protected.
    protected: bool,
    /// The last of them.
    from: Option<Span>,
}

/// One class of the inheritance tree, the class itself first.
#[derive(Debug)]
pub struct Frame {
    /// The class.
    pub class: ClassId,
    /// Frames whose elements are visible from here: itself and all its bases.
    pub visible: Vec<u32>,
    /// Modifications of the `extends` clauses on the way from the class to this base, innermost last, each with the frame
    /// its expressions belong to.
    pub modifications: Vec<(u32, Arc<AstMod>)>,
    /// Inherited by an `extends` clause in a protected section.
    pub protected: bool,
}

/// A component or class element.
#[derive(Debug)]
pub struct ShapeElement {
    /// Name.
    pub name: Name,
    /// The frame it was declared in.
    pub frame: u32,
    /// Position in the element list of the frame's class.
    pub position: u32,
    /// A component (true) or a class (false).
    pub component: bool,
    /// The declaration's own modification, of components.
    pub modification: Arc<AstMod>,
    /// Frame and position of the declaration that this one redeclares.
    pub replaced: Option<(u32, u32)>,
    /// Frames that declare the same element once more.
    pub also: Vec<u32>,
}

/// A class with everything inherited.
#[derive(Debug)]
pub struct Shape {
    /// The class and its bases.
    pub frames: Vec<Frame>,
    /// All elements in the order of the text, inherited ones in place of their `extends`.
    pub elements: Vec<ShapeElement>,
    /// Element by name.
    pub by_name: FxHashMap<Name, u32>,
    /// The builtin type it finally is, such as Real, for `type` classes.
    pub builtin: Option<Name>,
}

impl Shape {
    /// The definition of a frame.
    pub fn def<'t>(&self, table: &'t ClassTable<'_>, frame: u32) -> &'t Arc<ClassDef> {
        &table.class(self.frames[frame as usize].class).def
    }

    /// The element called `name`, if it is visible from `frame`.
    pub fn visible(&self, name: &str, frame: u32) -> Option<&ShapeElement> {
        let element = &self.elements[*self.by_name.get(name)? as usize];
        let visible = &self.frames[frame as usize].visible;
        let seen = visible.contains(&element.frame)
            || element.replaced.is_some_and(|(f, _)| visible.contains(&f))
            || element.also.iter().any(|frame| visible.contains(frame));
        seen.then_some(element)
    }
}

/// True for the names of predefined types.
pub fn is_builtin(name: &str) -> bool {
    matches!(
        name,
        "Real" | "Integer" | "Boolean" | "String" | "StateSelect" | "AssertionLevel" | "ExternalObject" | "Clock"
    )
}

/// Longest way from a class to a base class.
const MAX_BASES: usize = 100;

impl ClassTable<'_> {
    /// The shape of a class.  `Err` after a message has been given.
    pub fn shape(&mut self, class: ClassId) -> Result<Rc<Shape>, Reported> {
        if let Some(known) = &self.class(class).shape {
            return known.clone();
        }
        let mut shape =
            Shape { frames: Vec::new(), elements: Vec::new(), by_name: FxHashMap::default(), builtin: None };
        let mut open = Vec::new();
        self.open_shape(class);
        let way = Way { outer: &[], protected: false, from: None };
        let result = self.collect(class, &mut shape, way, &mut open).map(|_| Rc::new(shape));
        self.close_shape();
        self.class_mut(class).shape = Some(result.clone());
        self.check_imports(class);
        result
    }

    fn collect(
        &mut self,
        class: ClassId,
        shape: &mut Shape,
        way: Way<'_>,
        open: &mut Vec<ClassId>,
    ) -> Result<u32, Reported> {
        let def = self.class(class).def.clone();
        if open.contains(&class) {
            return Err(self.circle(class, open, way.from));
        }
        if open.len() >= MAX_BASES {
            let message = format!("classes extend each other deeper than {MAX_BASES} levels");
            self.report(Diagnostic::error(Code::Limit, message).at(way.from.unwrap_or(def.name.span), ""));
            return Err(Reported);
        }
        self.check_body(&def)?;
        open.push(class);
        let frame = shape.frames.len() as u32;
        let modifications = way.outer.to_vec();
        shape.frames.push(Frame { class, visible: vec![frame], modifications, protected: way.protected });
        let mut result = Ok(frame);
        // What a class extends by its name stands before what it adds.
        if let ClassBody::Long { extends_from: Some(modification), .. } = &def.body {
            let base = self.extended(class, def.name.span)?;
            self.inherit_class(shape, frame, base, modification, Way { from: Some(def.name.span), ..way }, open)?;
        }
        for (position, element) in elements(&def).iter().enumerate() {
            let added = match element {
                Element::Import(_) => Ok(()),
                Element::Extends(extends) => {
                    let way = Way { protected: way.protected || extends.protected, ..way };
                    self.inherit(shape, frame, &extends.base, &extends.modification, way, open)
                }
                Element::Class(nested) => {
                    let ident = nested.class.name.clone();
                    self.add_element(shape, frame, ident, position, false, &Modification::default())
                }
                Element::Component(component) => {
                    self.add_element(shape, frame, component.name.clone(), position, true, &component.modification)
                }
            };
            if added.is_err() {
                result = Err(Reported);
            }
        }
        if let ClassBody::Short { base, modification, .. } = &def.body {
            self.inherit(shape, frame, base, modification, way, open)?;
        }
        open.pop();
        result
    }

    fn inherit(
        &mut self,
        shape: &mut Shape,
        frame: u32,
        base: &hyd_syntax::tree::Path,
        modification: &Modification,
        way: Way<'_>,
        open: &mut Vec<ClassId>,
    ) -> Result<(), Reported> {
        if base.parts.len() == 1 && is_builtin(&base.parts[0].name) {
            shape.builtin = Some(base.parts[0].name.clone());
            if !modification.arguments.is_empty() {
                let own = Arc::new(AstMod::from_syntax(modification));
                shape.frames[frame as usize].modifications.push((frame, own));
            }
            return Ok(());
        }
        let class = shape.frames[frame as usize].class;
        let base_class = match self.class(class).base {
            Some(base) => base,
            None => self.find_class_static(class, base, true)?,
        };
        let kind = self.class(base_class).def.kind;
        if kind == ClassKind::Function && self.class(class).def.kind != ClassKind::Function {
            let message = format!("`{}` is a function and cannot be a base class here", self.full_name(base_class));
            self.report(Diagnostic::error(Code::Misplaced, message).at(base.span, ""));
            return Err(Reported);
        }
        self.inherit_class(shape, frame, base_class, modification, Way { from: Some(base.span), ..way }, open)
    }

    fn inherit_class(
        &mut self,
        shape: &mut Shape,
        frame: u32,
        base: ClassId,
        modification: &Modification,
        way: Way<'_>,
        open: &mut Vec<ClassId>,
    ) -> Result<(), Reported> {
        let mut modifications = way.outer.to_vec();
        if !modification.arguments.is_empty() {
            modifications.push((frame, Arc::new(AstMod::from_syntax(modification))));
        }
        let base_frame = self.collect(base, shape, Way { outer: &modifications, ..way }, open)?;
        let seen = shape.frames[base_frame as usize].visible.clone();
        shape.frames[frame as usize].visible.extend(seen);
        Ok(())
    }

    fn add_element(
        &mut self,
        shape: &mut Shape,
        frame: u32,
        ident: Ident,
        position: usize,
        component: bool,
        modification: &Modification,
    ) -> Result<(), Reported> {
        let Ident { name, span } = ident;
        if let Some(&known) = shape.by_name.get(&name) {
            return self.check_duplicate(shape, known, frame, position, span);
        }
        shape.by_name.insert(name.clone(), shape.elements.len() as u32);
        shape.elements.push(ShapeElement {
            name,
            frame,
            position: position as u32,
            component,
            modification: Arc::new(AstMod::from_syntax(modification)),
            replaced: None,
            also: Vec::new(),
        });
        Ok(())
    }
}
