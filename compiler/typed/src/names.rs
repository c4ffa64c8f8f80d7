//! References: what a name means, and its type.

use std::rc::Rc;

use hyd_instance::{Env, InstId, LocalClass, Resolved, ScalarType, Scope};
use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{self as text, ClassBody, ClassDef, ClassKind, Component, ComponentRef, Element};

use crate::elaborate::Elaborator;
use crate::expression::{Expr, Kind, Local, Variable};
use crate::types::{Base, RecordType, Type};

/// The dimensions that subscripts leave of so many.
fn rank_left(rank: usize, subscripts: &[Expr]) -> usize {
    rank.saturating_sub(subscripts.iter().filter(|s| s.ty.rank == 0).count())
}

impl Elaborator<'_, '_> {
    pub(crate) fn local_type(&self, reference: &ComponentRef) -> Option<&Type> {
        let name = &reference.parts[0].name.name;
        let found = || self.locals.iter().rev().find(|(n, _)| n == name).map(|(_, ty)| ty);
        if reference.global { None } else { found() }
    }

    /// A reference as an expression.
    pub fn reference(&mut self, reference: &ComponentRef) -> Result<Expr, Reported> {
        if let Some(ty) = self.local_type(reference) {
            let ty = ty.clone();
            return self.local(reference, ty);
        }
        if hyd_instance::names_boolean(reference) {
            let ty = Type { base: Base::Scalar(ScalarType::Boolean), rank: 1 };
            return Ok(Expr { kind: Kind::Values(None, Rc::new(reference.clone())), ty, span: reference.span });
        }
        if let Some(named) = self.scopes.parts_named(reference, self.scope, &Env::default()) {
            return self.expr(&named);
        }
        let span = reference.span;
        let (kind, ty) = match self.scopes.resolve(self.scope, reference)? {
            Resolved::Time => (Kind::Time, Type::scalar(ScalarType::Real)),
            Resolved::Literal(enumeration, k) => {
                let ty = Type::scalar(ScalarType::Enumeration(enumeration.clone()));
                (Kind::Literal(enumeration, k, Rc::new(reference.clone())), ty)
            }
            Resolved::Class(local) => match self.scopes.enumeration(local.class) {
                Some(enumeration) => {
                    let base = Base::Scalar(ScalarType::Enumeration(enumeration.clone()));
                    (Kind::Values(Some(enumeration), Rc::new(reference.clone())), Type { base, rank: 1 })
                }
                None => (Kind::Class(Box::new(local), Rc::new(reference.clone())), Type::NONE),
            },
            Resolved::Variable(steps) => {
                let mut typed = Vec::with_capacity(steps.len());
                let mut rank = 0;
                for (inst, subscripts) in steps {
                    let subscripts = self.all(subscripts)?;
                    rank += rank_left(self.scopes.instances[inst].dims.len(), &subscripts);
                    typed.push((inst, subscripts));
                }
                let last = typed[typed.len() - 1].0;
                let base = self.base_of(last);
                (Kind::Variable(Variable { steps: typed, reference: Rc::new(reference.clone()) }), Type { base, rank })
            }
        };
        Ok(Expr { kind, ty, span })
    }

    /// One element of an instance, seen from the model: `at` has a subscript (from 0) for each array around it and of its own.
    pub fn element(&mut self, inst: InstId, at: &[usize], span: Span) -> Expr {
        let mut steps = Vec::new();
        let mut reference = ComponentRef { global: false, parts: Vec::new(), span };
        let mut rest = at.iter();
        for id in hyd_instance::instance::chain(&self.scopes.instances, inst).into_iter().skip(1) {
            let instance = &self.scopes.instances[id];
            let taken: Vec<i64> = rest.by_ref().take(instance.dims.len()).map(|&k| k as i64 + 1).collect();
            let typed =
                taken.iter().map(|&k| Expr { kind: Kind::Integer(k), ty: Type::scalar(ScalarType::Integer), span });
            let written = taken.iter().map(|&k| text::Expr { kind: text::ExprKind::Integer(k), span });
            let name = text::Ident { name: instance.name.clone(), span };
            reference.parts.push(text::RefPart { name, subscripts: written.collect() });
            steps.push((id, typed.collect()));
        }
        let ty = Type { base: self.base_of(inst), rank: 0 };
        Expr { kind: Kind::Variable(Variable { steps, reference: Rc::new(reference) }), ty, span }
    }

    fn local(&mut self, reference: &ComponentRef, root: Type) -> Result<Expr, Reported> {
        let mut ty = root;
        let mut parts = Vec::with_capacity(reference.parts.len());
        for (k, part) in reference.parts.iter().enumerate() {
            if k > 0 {
                ty = ty.field(&part.name.name).unwrap_or(Type::NONE);
            }
            let subscripts = self.all(&part.subscripts)?;
            ty = ty.with_rank(rank_left(ty.rank, &subscripts));
            parts.push((part.name.clone(), subscripts));
        }
        let kind = Kind::Local(Local { parts, reference: Rc::new(reference.clone()) });
        Ok(Expr { kind, ty, span: reference.span })
    }

    /// What one element of a component is.
    fn base_of(&mut self, inst: InstId) -> Base {
        let instance = &self.scopes.instances[inst];
        if let Some(primitive) = &instance.primitive {
            return Base::Scalar(primitive.scalar.clone());
        }
        if !self.scopes.is_record(inst) {
            return Base::None;
        }
        if let Some(known) = self.typing.records.get(&inst) {
            return Base::Record(known.clone());
        }
        let name = instance.class.map(|class| self.scopes.table.full_name(class)).unwrap_or_default();
        let mut fields = Vec::new();
        for child in self.scopes.instances[inst].children.clone() {
            let rank = self.scopes.instances[child].dims.len();
            let field = self.scopes.instances[child].name.clone();
            fields.push((field, Type { base: self.base_of(child), rank }));
        }
        let class = self.scopes.instances[inst].class;
        let record = Rc::new(RecordType { name, class, inst: None, fields });
        self.typing.records.insert(inst, record.clone());
        Base::Record(record)
    }

    /// The type of a variable of a function, or of a field of a record, from its declaration.
    ///
    /// # Errors
    /// When its class is none for a variable; reported.
    pub fn declared_type(&mut self, scope: Scope, component: &Component) -> Result<Type, Reported> {
        let rank = component.dims.len();
        if let [only] = component.class.parts.as_slice()
            && let Some(scalar) = predefined(&only.name)
        {
            return Ok(Type { base: Base::Scalar(scalar), rank });
        }
        let local = self.scopes.find_class(scope, &component.class)?;
        let shape = self.scopes.table.shape(local.class)?;
        // `type Vector = Real[3]` has dimensions of its own.
        let rank = rank
            + (0..shape.frames.len() as u32).map(|k| own_dims(shape.def(&self.scopes.table, k)).len()).sum::<usize>();
        if let Some(enumeration) = self.scopes.enumeration(local.class) {
            return Ok(Type { base: Base::Scalar(ScalarType::Enumeration(enumeration)), rank });
        }
        if let Some(scalar) = shape.builtin.as_deref().and_then(predefined) {
            return Ok(Type { base: Base::Scalar(scalar), rank });
        }
        if self.scopes.table.class(local.class).def.kind == ClassKind::Function {
            let inst = self.scopes.package_of(&local)?;
            if self.typing.open.contains(&inst) {
                let name = self.scopes.table.full_name(local.class);
                let message = format!("`{name}` takes or gives a function of its own type");
                return Err(self.error(Code::CircularClass, component.class.span, message));
            }
            let result = self.type_of_outputs(&local)?;
            return Ok(Type { base: Base::Function(Rc::new(result)), rank });
        }
        if self.scopes.table.class(local.class).def.kind != ClassKind::Record {
            let message = format!("`{}` cannot be a variable of a function", component.name.name);
            return Err(self.error(Code::TypeMismatch, component.name.span, message));
        }
        Ok(Type { base: self.record_base(&local)?, rank })
    }

    /// The sizes that short definitions add to a declaration, each read where it is written.
    pub fn dims_of_type(&mut self, scope: Scope, component: &Component) -> Vec<Expr> {
        if matches!(component.class.parts.as_slice(), [only] if predefined(&only.name).is_some()) {
            return Vec::new();
        }
        // The type of the declaration has been asked for before, with all that may be wrong with it.
        let Ok(local) = self.scopes.find_class(scope, &component.class) else { return Vec::new() };
        let Ok(shape) = self.scopes.table.shape(local.class) else { return Vec::new() };
        let mut typed = Vec::new();
        for frame in 0..shape.frames.len() as u32 {
            let def = shape.def(&self.scopes.table, frame).clone();
            if own_dims(&def).is_empty() {
                continue;
            }
            let Ok(inst) = self.scopes.package_of(&local) else { continue };
            let scope = Scope { inst, frame };
            let mut there = Elaborator::new(&mut *self.scopes, &mut *self.typing, scope, Vec::new());
            typed.extend(own_dims(&def).iter().map(|dim| there.deferred(dim)));
        }
        typed
    }

    /// All sizes of a declaration that stands in a scope: its own and those of its type.
    pub fn declared_dims(&mut self, scope: Scope, component: &Component) -> Vec<Expr> {
        let mut there = Elaborator::new(&mut *self.scopes, &mut *self.typing, scope, Vec::new());
        let mut dims: Vec<Expr> = component.dims.iter().map(|dim| there.deferred(dim)).collect();
        dims.extend(self.dims_of_type(scope, component));
        dims
    }

    /// A record as its declaration has it.
    pub(crate) fn record_base(&mut self, local: &LocalClass) -> Result<Base, Reported> {
        let shape = self.scopes.table.shape(local.class)?;
        let inst = self.scopes.package_of(local)?;
        if let Some(known) = self.typing.records.get(&inst) {
            return Ok(Base::Record(known.clone()));
        }
        let name = self.scopes.table.full_name(local.class);
        // A record that holds itself is reported by whoever makes one.
        let record =
            |fields| Rc::new(RecordType { name: name.clone(), class: Some(local.class), inst: Some(inst), fields });
        self.typing.records.insert(inst, record(Vec::new()));
        let (mut fields, mut dims) = (Vec::new(), Vec::new());
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = self.scopes.table.class(shape.frames[element.frame as usize].class).def.clone();
            let declared = &hyd_instance::class::elements(&owner)[element.position as usize];
            if let Element::Component(field) = declared {
                let scope = Scope { inst, frame: element.frame };
                match self.declared_type(scope, field) {
                    Ok(ty) => {
                        fields.push((element.name.clone(), ty));
                        dims.push((element.frame, self.declared_dims(scope, field)));
                    }
                    Err(Reported) => {
                        self.typing.records.remove(&inst);
                        return Err(Reported);
                    }
                }
            }
        }
        let record = record(fields);
        self.typing.records.insert(inst, record.clone());
        self.typing.dims.insert(inst, dims.into());
        Ok(Base::Record(record))
    }
}

/// The dimensions that a short definition adds.
fn own_dims(def: &ClassDef) -> &[text::Expr] {
    match &def.body {
        ClassBody::Short { dims, .. } => dims,
        _ => &[],
    }
}

fn predefined(name: &str) -> Option<ScalarType> {
    match name {
        "Real" => Some(ScalarType::Real),
        "Integer" => Some(ScalarType::Integer),
        "Boolean" => Some(ScalarType::Boolean),
        "String" => Some(ScalarType::Text),
        "ExternalObject" => Some(ScalarType::Object),
        "Clock" => Some(ScalarType::Clock),
        _ => None,
    }
}
