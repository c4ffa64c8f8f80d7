//! The shape of a class: its elements and equations with those of its base classes, in one list.
//!
//! Computed once per class and shared by all its instances.  Every base class is a *frame*: names in a declaration are
//! looked up among the elements of the frame it was written in and of that frame's own bases (Modelica 3.6, section 7.1).

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassBody, ClassDef, ClassKind, Element, Modification, Name};
use rustc_hash::FxHashMap;

use crate::class::{ClassId, ClassTable, elements};
use crate::modifier::AstMod;

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
        self.frames[frame as usize].visible.contains(&element.frame).then_some(element)
    }
}

/// True for the names of predefined types.
pub fn is_builtin(name: &str) -> bool {
    matches!(name, "Real" | "Integer" | "Boolean" | "String" | "StateSelect" | "AssertionLevel")
}

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
        let result = self.collect(class, &mut shape, &[], &mut open, None).map(|_| Rc::new(shape));
        self.close_shape();
        self.class_mut(class).shape = Some(result.clone());
        self.check_imports(class);
        result
    }

    fn collect(
        &mut self,
        class: ClassId,
        shape: &mut Shape,
        outer: &[(u32, Arc<AstMod>)],
        open: &mut Vec<ClassId>,
        from: Option<Span>,
    ) -> Result<u32, Reported> {
        let def = self.class(class).def.clone();
        if open.contains(&class) {
            let message = format!("`{}` extends itself", self.full_name(class));
            self.report(
                Diagnostic::error(Code::CircularClass, message)
                    .at(from.unwrap_or(def.name.span), "the circle closes here")
                    .with(def.name.span, "declared here"),
            );
            return Err(Reported);
        }
        self.check_body(&def)?;
        open.push(class);
        let frame = shape.frames.len() as u32;
        shape.frames.push(Frame { class, visible: vec![frame], modifications: outer.to_vec() });
        let mut result = Ok(frame);
        for (position, element) in elements(&def).iter().enumerate() {
            let added = match element {
                Element::Import(_) => Ok(()),
                Element::Extends(extends) => {
                    self.inherit(shape, frame, &extends.base, &extends.modification, outer, open)
                }
                Element::Class(nested) => {
                    let name = nested.class.name.name.clone();
                    if matches!(nested.class.body, ClassBody::Long { extends_from: Some(_), .. }) {
                        self.check_body(&nested.class)
                    } else {
                        self.add_element(
                            shape,
                            frame,
                            name,
                            position,
                            false,
                            &Modification::default(),
                            nested.class.name.span,
                        )
                    }
                }
                Element::Component(component) => self.add_element(
                    shape,
                    frame,
                    component.name.name.clone(),
                    position,
                    true,
                    &component.modification,
                    component.name.span,
                ),
            };
            if added.is_err() {
                result = Err(Reported);
            }
        }
        if let ClassBody::Short { base, modification, .. } = &def.body {
            self.inherit(shape, frame, base, modification, outer, open)?;
        }
        open.pop();
        result
    }

    /// Forms of classes that are outside the profile, and literals of an enumeration that are said twice.
    fn check_body(&mut self, def: &ClassDef) -> Result<(), Reported> {
        let outside = match &def.body {
            ClassBody::Long { extends_from: Some(_), .. } => "extending a redeclared class (`redeclare model extends`)",
            ClassBody::DerivativeOf(..) => "a function as a derivative of another (`der(f, x)`)",
            ClassBody::Enumeration(Some(literals)) => {
                for (k, literal) in literals.iter().enumerate() {
                    let Some(first) = literals[..k].iter().find(|l| l.name.name == literal.name.name) else { continue };
                    let message = format!("the literal `{}` is declared twice", literal.name.name);
                    self.report(
                        Diagnostic::error(Code::Redefinition, message)
                            .at(literal.name.span, "second declaration")
                            .with(first.name.span, "first declaration"),
                    );
                    return Err(Reported);
                }
                return Ok(());
            }
            _ => return Ok(()),
        };
        let message = format!("{outside} is outside the language profile");
        self.report(Diagnostic::error(Code::OutsideProfile, message).at(def.name.span, ""));
        Err(Reported)
    }

    fn inherit(
        &mut self,
        shape: &mut Shape,
        frame: u32,
        base: &hyd_syntax::tree::Path,
        modification: &Modification,
        outer: &[(u32, Arc<AstMod>)],
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
        let base_class = self.find_class_static(class, base, true)?;
        let kind = self.class(base_class).def.kind;
        if kind == ClassKind::Function && self.class(class).def.kind != ClassKind::Function {
            let message = format!("`{}` is a function and cannot be a base class here", self.full_name(base_class));
            self.report(Diagnostic::error(Code::Misplaced, message).at(base.span, ""));
            return Err(Reported);
        }
        let mut modifications = outer.to_vec();
        if !modification.arguments.is_empty() {
            modifications.push((frame, Arc::new(AstMod::from_syntax(modification))));
        }
        let base_frame = self.collect(base_class, shape, &modifications, open, Some(base.span))?;
        let seen = shape.frames[base_frame as usize].visible.clone();
        shape.frames[frame as usize].visible.extend(seen);
        Ok(())
    }

    #[allow(clippy::too_many_arguments)]
    fn add_element(
        &mut self,
        shape: &mut Shape,
        frame: u32,
        name: Name,
        position: usize,
        component: bool,
        modification: &Modification,
        span: Span,
    ) -> Result<(), Reported> {
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
        });
        Ok(())
    }

    /// An element inherited twice on different ways is one element; `redeclare` elements are handled when instantiated;
    /// anything else is a second declaration of the name.
    fn check_duplicate(
        &mut self,
        shape: &mut Shape,
        known: u32,
        frame: u32,
        position: usize,
        span: Span,
    ) -> Result<(), Reported> {
        let element = &shape.elements[known as usize];
        let (here, there) = (shape.frames[frame as usize].class, shape.frames[element.frame as usize].class);
        let redeclares = |table: &Self, class: ClassId, k: usize| match &elements(&table.class(class).def)[k] {
            Element::Component(c) => c.prefixes.redeclare,
            Element::Class(c) => c.prefixes.redeclare,
            _ => false,
        };
        if here == there && element.position == position as u32 {
            return Ok(());
        }
        if redeclares(self, here, position) {
            // The new declaration takes the place of the inherited one.
            let slot = &mut shape.elements[known as usize];
            slot.frame = frame;
            slot.position = position as u32;
            let def = self.class(here).def.clone();
            if let Element::Component(component) = &elements(&def)[position] {
                slot.modification = Arc::new(AstMod::from_syntax(&component.modification));
            }
            return Ok(());
        }
        if redeclares(self, there, element.position as usize) {
            return Ok(());
        }
        let first = match &elements(&self.class(there).def)[element.position as usize] {
            Element::Component(c) => c.name.span,
            Element::Class(c) => c.class.name.span,
            _ => span,
        };
        let message = format!("`{}` is declared twice", element.name);
        self.report(
            Diagnostic::error(Code::Redefinition, message)
                .at(span, "second declaration")
                .with(first, "first declaration"),
        );
        Err(Reported)
    }
}
