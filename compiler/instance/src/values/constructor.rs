//! Records made from their declarations: which arguments a constructor takes, and the values of the fields it does not get.
//!
//! The fields are those of the class with everything inherited, in the order of the text; what is `final` is not an argument
//! (Modelica 3.6, section 12.6.1).  A field that gets no argument has the outermost of what modifications, `extends` clauses, short
//! definitions and its declaration say of it (7.2.4), and may depend on other fields, wherever they stand.  The same holds for a
//! record that is a variable of a function (12.4.4).  What a value is, is the maker's matter: numbers before the run or expressions.

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span, did_you_mean};
use hyd_syntax::tree::{ClassKind, Component, ComponentRef, Expr, ExprKind, Ident, Name};
use hyd_syntax::visit::{Role, Visitor, walk_reference};

use crate::classes::modifier::{AstMod, Redeclare};
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::{Scopes, variability_of};
use crate::instantiation::type_of::TypeOf;

/// One thing said of a record or of a field.
#[derive(Clone, Debug)]
pub struct Said {
    /// What is said.
    pub tree: Arc<AstMod>,
    /// Where its names are looked up.
    pub scope: Scope,
    /// Subscripts of the values it gives: it speaks of an array of records, and this is one of them.
    pub at: Vec<usize>,
}

impl Said {
    /// What it says of a field of the element `at` of the records it speaks of.
    fn of_field(&self, name: &Name, at: &[usize], list: &mut Vec<Said>) {
        for (_, tree) in self.tree.children.iter().filter(|(child, _)| child == name) {
            let mut own = self.at.clone();
            match (tree.each, at.is_empty()) {
                (false, _) => own.extend(at),
                (true, true) => drop(own.pop()),
                (true, false) => {}
            }
            list.push(Said { tree: tree.clone(), scope: self.scope, at: own });
        }
        if let Some(record) = &self.tree.binding {
            let ident = Ident { name: name.clone(), span: record.span };
            let field = Expr { kind: ExprKind::Field(Box::new((**record).clone()), ident), span: record.span };
            let own = self.at.iter().chain(at).copied().collect();
            list.push(Said { tree: Arc::new(AstMod::of_binding(field)), scope: self.scope, at: own });
        }
    }
}

/// A field of a record with all that is said of it.
#[derive(Debug)]
pub struct RecordField {
    /// Its name.
    pub name: Name,
    /// Its declaration, or the one that redeclares it.
    pub declaration: Component,
    /// Where the declaration's sizes are looked up.
    pub scope: Scope,
    /// Where its class is looked up.
    pub type_scope: Scope,
    /// What is said of it, outermost first, its own declaration included.
    pub said: Vec<Said>,
    /// No argument can give it another value.
    pub is_final: bool,
}

/// An argument of a constructor.
#[derive(Debug)]
pub struct Input {
    /// The field.
    pub name: Name,
    /// It may be left out.
    pub has_default: bool,
}

/// Whoever makes values of fields.
pub trait RecordMaker<'s> {
    /// A value; that of a record has fields.
    type Value: Clone;
    /// Why there is none.
    type Fail: From<Reported>;
    /// What names mean.
    fn scopes(&mut self) -> &mut Scopes<'s>;
    /// The argument of a field.
    fn given(&mut self, expr: &Expr, field: &RecordField) -> Result<Self::Value, Self::Fail>;
    /// The value of an expression that stands in a record, whose fields have these values, or outside of all records being made.
    fn said(
        &mut self,
        expr: &Expr,
        scope: Scope,
        fields: Option<&[(Name, Self::Value)]>,
        field: &RecordField,
    ) -> Result<Self::Value, Self::Fail>;
    /// The part of a value at subscripts from 1.
    fn part(&mut self, span: Span, value: Self::Value, at: &[usize]) -> Result<Self::Value, Self::Fail>;
    /// The sizes that the declaration of a field gives.
    fn sizes(&mut self, field: &RecordField, fields: &[(Name, Self::Value)]) -> Result<Vec<usize>, Self::Fail>;
    /// A field of which nothing is said; `None` if it has no value yet.
    fn unset(&mut self, field: &RecordField, fields: &[(Name, Self::Value)])
    -> Result<Option<Self::Value>, Self::Fail>;
    /// A record of a class.
    fn record(&mut self, local: &LocalClass, fields: Vec<(Name, Self::Value)>) -> Self::Value;
    /// Values as an array with one dimension more.
    fn array(&mut self, span: Span, items: Vec<Self::Value>) -> Result<Self::Value, Self::Fail>;
    /// An array of records of a class with these sizes, the first of which is 0.
    fn no_elements(&mut self, span: Span, local: &LocalClass, sizes: &[usize]) -> Result<Self::Value, Self::Fail>;
}

/// Deepest nesting of records in records.
const MAX_NESTED: usize = 50;

/// A record in the making.
struct Level<V> {
    inst: InstId,
    fields: Rc<[RecordField]>,
    given: Vec<(Name, Expr)>,
    done: Vec<(Name, V)>,
    open: Vec<Name>,
}

/// Makes the record of a constructor call.  `only`: that field is wanted and no other.
pub fn construct<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    local: &LocalClass,
    given: Vec<(Name, Expr)>,
    only: Option<&Name>,
) -> Result<M::Value, M::Fail> {
    make(maker, &mut Vec::new(), local, (&[], &[]), given, only)
}

/// Makes a variable of a function: a record or an array of records, from its declaration.
pub fn declared<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    local: &LocalClass,
    said: &[Said],
    sizes: &[usize],
    span: Span,
) -> Result<M::Value, M::Fail> {
    make_array(maker, &mut Vec::new(), local, said, (sizes, &mut Vec::new()), span)
}

fn make<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    levels: &mut Vec<Level<M::Value>>,
    local: &LocalClass,
    (said, at): (&[Said], &[usize]),
    given: Vec<(Name, Expr)>,
    only: Option<&Name>,
) -> Result<M::Value, M::Fail> {
    if levels.len() >= MAX_NESTED {
        let table = &mut maker.scopes().table;
        let (name, span) = (table.full_name(local.class), table.class(local.class).def.name.span);
        let message = format!("records are nested deeper than {MAX_NESTED} levels: does `{name}` hold itself?");
        table.report(Diagnostic::error(Code::Limit, message).at(span, "declared here"));
        return Err(Reported.into());
    }
    let (inst, fields) = maker.scopes().record_fields(local, said, at)?;
    let fields: Rc<[RecordField]> = fields.into();
    levels.push(Level { inst, fields: fields.clone(), given, done: Vec::new(), open: Vec::new() });
    let level = levels.len() - 1;
    let wanted = |k: &usize| only.is_none_or(|name| fields[*k].name == *name);
    let made = (0..fields.len()).filter(wanted).try_for_each(|k| make_field(maker, levels, level, k));
    let mut done = levels.pop().map_or_else(Vec::new, |level| level.done);
    made?;
    done.sort_by_key(|(name, _)| fields.iter().position(|field| field.name == *name));
    Ok(maker.record(local, done))
}

fn make_array<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    levels: &mut Vec<Level<M::Value>>,
    local: &LocalClass,
    said: &[Said],
    (sizes, at): (&[usize], &mut Vec<usize>),
    span: Span,
) -> Result<M::Value, M::Fail> {
    let Some((&size, rest)) = sizes.split_first() else {
        return make(maker, levels, local, (said, at), Vec::new(), None);
    };
    if size == 0 {
        return maker.no_elements(span, local, sizes);
    }
    let mut items = Vec::with_capacity(size);
    for k in 1..=size {
        at.push(k);
        let item = make_array(maker, levels, local, said, (rest, at), span);
        at.pop();
        items.push(item?);
    }
    maker.array(span, items)
}

/// Makes field `k` of a record, and before it those that it depends on.
fn make_field<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    levels: &mut Vec<Level<M::Value>>,
    level: usize,
    k: usize,
) -> Result<(), M::Fail> {
    let fields = levels[level].fields.clone();
    let field = &fields[k];
    if levels[level].done.iter().any(|(name, _)| *name == field.name) {
        return Ok(());
    }
    if levels[level].open.contains(&field.name) {
        let message = format!("the value of the field `{}` depends on itself", field.name);
        let diagnostic = Diagnostic::error(Code::CircularParameters, message);
        maker.scopes().table.report(diagnostic.at(field.declaration.name.span, "declared here"));
        return Err(Reported.into());
    }
    let given = levels[level].given.iter().find(|(name, _)| *name == field.name).map(|(_, expr)| expr.clone());
    levels[level].open.push(field.name.clone());
    let value = match given {
        Some(expr) => maker.given(&expr, field).map(Some),
        None => by_default(maker, levels, level, field),
    };
    levels[level].open.pop();
    if let Some(value) = value? {
        levels[level].done.push((field.name.clone(), value));
    }
    Ok(())
}

/// The value of a field that gets no argument.
fn by_default<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    levels: &mut Vec<Level<M::Value>>,
    level: usize,
    field: &RecordField,
) -> Result<Option<M::Value>, M::Fail> {
    let first = field.said.iter().find(|s| s.tree.binding.is_some() || !s.tree.children.is_empty());
    let whole = first.is_some_and(|s| s.tree.binding.is_some() && s.tree.children.is_empty());
    if !whole && let Some(local) = maker.scopes().record_of(field)? {
        field.declaration.dims.iter().try_for_each(|dim| make_named(maker, levels, level, dim))?;
        let sizes = maker.sizes(field, &levels[level].done)?;
        let span = field.declaration.name.span;
        return make_array(maker, levels, &local, &field.said, (&sizes, &mut Vec::new()), span).map(Some);
    }
    let bound = field.said.iter().find_map(|said| Some((said, said.tree.binding.clone()?)));
    let Some((said, expr)) = bound else {
        field.declaration.dims.iter().try_for_each(|dim| make_named(maker, levels, level, dim))?;
        return maker.unset(field, &levels[level].done);
    };
    let around = levels.iter().rposition(|level| level.inst == said.scope.inst);
    let value = match around {
        Some(around) => {
            make_named(maker, levels, around, &expr)?;
            maker.said(&expr, said.scope, Some(&levels[around].done), field)?
        }
        None => maker.said(&expr, said.scope, None, field)?,
    };
    if said.at.is_empty() { Ok(Some(value)) } else { maker.part(expr.span, value, &said.at).map(Some) }
}

/// Makes the fields of a record that an expression names.
fn make_named<'s, M: RecordMaker<'s>>(
    maker: &mut M,
    levels: &mut Vec<Level<M::Value>>,
    level: usize,
    expr: &Expr,
) -> Result<(), M::Fail> {
    struct Search(Vec<Name>);
    impl Visitor for Search {
        fn reference(&mut self, reference: &ComponentRef, role: Role) {
            if role == Role::Read && !reference.global {
                self.0.push(reference.parts[0].name.name.clone());
            }
            walk_reference(self, reference);
        }
    }
    let mut search = Search(Vec::new());
    search.expr(expr);
    for name in search.0 {
        let own = levels[level].fields.iter().position(|field| field.name == name);
        // What is named in the record itself while it is being made is found out there.
        if let Some(k) = own {
            make_field(maker, levels, level, k)?;
        }
    }
    Ok(())
}

impl Scopes<'_> {
    /// The fields of a record class in the order of the text.  `at`: subscripts of the element that is meant, where what is said
    /// speaks of an array of such records.
    fn record_fields(
        &mut self,
        local: &LocalClass,
        said: &[Said],
        at: &[usize],
    ) -> Result<(InstId, Vec<RecordField>), Reported> {
        let shape = self.table.shape(local.class)?;
        let inst = self.package_of(local)?;
        let mut fields = Vec::new();
        for element in shape.elements.iter().filter(|e| e.component) {
            let Some(mut declaration) = self.declared(&shape, element) else { continue };
            let own = Scope { inst, frame: element.frame };
            let mut list = Vec::new();
            said.iter().for_each(|said| said.of_field(&element.name, at, &mut list));
            let with_class = local.mods.iter().map(|a| (a.scope, &a.tree));
            let inherited = shape.frames[element.frame as usize].modifications.iter();
            let inherited: Vec<(Scope, &Arc<AstMod>)> =
                inherited.map(|(frame, tree)| (self.scope_of_modifier(inst, *frame), tree)).collect();
            for (scope, tree) in with_class.chain(inherited) {
                let said = Said { tree: tree.clone(), scope, at: Vec::new() };
                said.of_field(&element.name, &[], &mut list);
            }
            let mut type_scope = own;
            let redeclared = list.iter().position(|s| matches!(s.tree.redeclare, Some(Redeclare::Component(_))));
            if let Some(position) = redeclared
                && let Some(Redeclare::Component(new)) = &list[position].tree.redeclare
            {
                let (scope, new) = (list[position].scope, new.clone());
                list.truncate(position);
                let tree = Arc::new(AstMod::from_syntax(&new.modification));
                list.push(Said { tree, scope, at: Vec::new() });
                let kept = declaration.constrained_by.as_ref().map(|c| &c.modification);
                let kept = Arc::new(AstMod::from_syntax(kept.unwrap_or(&declaration.modification)));
                list.push(Said { tree: kept, scope: own, at: Vec::new() });
                type_scope = scope;
                let dims = if new.dims.is_empty() { declaration.dims.clone() } else { new.dims.clone() };
                declaration = Component {
                    prefixes: declaration.prefixes.clone(),
                    variability: variability_of(&new, &declaration),
                    dims,
                    ..(*new).clone()
                };
            } else {
                list.push(Said { tree: element.modification.clone(), scope: own, at: Vec::new() });
                if let Some(constraint) = &declaration.constrained_by {
                    let tree = Arc::new(AstMod::from_syntax(&constraint.modification));
                    list.push(Said { tree, scope: own, at: Vec::new() });
                }
            }
            let is_final = declaration.prefixes.is_final || list.iter().any(|said| said.tree.is_final);
            let name = element.name.clone();
            fields.push(RecordField { name, declaration, scope: own, type_scope, said: list, is_final });
        }
        Ok((inst, fields))
    }

    /// The class of a field that is a record.
    fn record_of(&mut self, field: &RecordField) -> Result<Option<LocalClass>, Reported> {
        Ok(match self.type_of(field.type_scope, &field.declaration.class)? {
            TypeOf::Class(local, _) if self.table.class(local.class).def.kind == ClassKind::Record => Some(local),
            _ => None,
        })
    }

    /// The arguments that the constructor of a record takes, in their order.
    pub fn inputs_of_constructor(&mut self, local: &LocalClass) -> Result<Rc<[Input]>, Reported> {
        if let Some(known) = self.constructors.get(&(local.class, local.context)) {
            return Ok(known.clone());
        }
        let (_, fields) = self.record_fields(local, &[], &[])?;
        let mut inputs = Vec::with_capacity(fields.len());
        for field in fields.into_iter().filter(|field| !field.is_final) {
            let bound = field.said.iter().any(|said| said.tree.binding.is_some());
            let has_default = bound || self.record_of(&field)?.is_some();
            inputs.push(Input { name: field.name, has_default });
        }
        let inputs: Rc<[Input]> = inputs.into();
        self.constructors.insert((local.class, local.context), inputs.clone());
        Ok(inputs)
    }

    /// The arguments of a constructor call by field: they name fields that the record has, each once, and leave out only those
    /// with a default (12.6.1).
    pub fn constructor_arguments(
        &mut self,
        local: &LocalClass,
        span: Span,
        positional: &[Expr],
        named: &[(Ident, Expr)],
    ) -> Result<Vec<(Name, Expr)>, Reported> {
        let inputs = self.inputs_of_constructor(local)?;
        let record = self.table.full_name(local.class);
        let declared = self.table.class(local.class).def.name.span;
        let fault = |message: String, at: Span| {
            Diagnostic::error(Code::BadArguments, message).at(at, "").with(declared, "the record is declared here")
        };
        if let Some(extra) = positional.get(inputs.len()) {
            let message = format!("`{record}` has {} fields, but {} values are given", inputs.len(), positional.len());
            self.table.report(fault(message, extra.span));
            return Err(Reported);
        }
        let mut given: Vec<(Name, Expr)> =
            inputs.iter().zip(positional).map(|(input, expr)| (input.name.clone(), expr.clone())).collect();
        for (name, value) in named {
            let known = inputs.iter().position(|input| input.name == name.name);
            let message = match known {
                Some(k) if k < positional.len() => {
                    format!("the field `{}` has a value already, by its position", name.name)
                }
                Some(_) if given.iter().any(|(n, _)| *n == name.name) => {
                    format!("the field `{}` is given a value twice", name.name)
                }
                Some(_) => {
                    given.push((name.name.clone(), value.clone()));
                    continue;
                }
                None if self.table.shape(local.class)?.by_name.contains_key(&name.name) => {
                    format!("the field `{}` of `{record}` is final and takes no value", name.name)
                }
                None => {
                    let help = did_you_mean(&name.name, inputs.iter().map(|input| input.name.as_ref()));
                    let message = format!("`{record}` has no field `{}`", name.name);
                    self.table.report(fault(message, name.span).maybe_help(help));
                    return Err(Reported);
                }
            };
            self.table.report(fault(message, name.span.to(value.span)));
            return Err(Reported);
        }
        let missing = inputs.iter().find(|i| !i.has_default && given.iter().all(|(name, _)| *name != i.name));
        if let Some(input) = missing {
            let message = format!("the field `{}` has no value", input.name);
            self.table.report(fault(message, span));
            return Err(Reported);
        }
        Ok(given)
    }
}
