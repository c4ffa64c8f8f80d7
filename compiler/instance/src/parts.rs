//! Arrays of components whose elements differ in size or structure: one instance an element.
//!
//! An array of components is one instance as long as its elements share their structure.  A parameter that decides sizes,
//! conditions or equations may have another value in each element (Modelica 3.6, section 7.2.5).  Such an array is noted in
//! [`InstanceTree::differing`] when the value is asked for; the model is then instantiated anew with the array made *in parts*: the
//! array itself is only a name with sizes, its elements `c[1]`, `c[2]`, ... are components of their own.  References take the part
//! that their subscripts name (`part_text`), values of modifications are taken apart by [`InstanceTree::evaluate_applied`].

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassKind, Component, Expr, ExprKind, Name, Variability};

use crate::build::InstanceTree;
use crate::evaluate::Env;
use crate::instance::{InstId, LocalClass, chain, path};
use crate::modifier::{Applied, Mods};
use crate::shape::Shape;
use crate::value::{Value, first_if_uniform};

/// Most elements of an array that is made in parts.
const MAX_PARTS: usize = 100_000;

impl InstanceTree<'_> {
    /// Paths of arrays of components whose elements were found to differ where they must not: to be instantiated in parts.
    pub fn differing(&self) -> &BTreeSet<String> {
        &self.differing
    }

    /// The name that the component was declared with.
    pub fn declared_name(&self, inst: InstId) -> &Name {
        let declared = self.instances[inst].part_of.as_ref().map_or(inst, |(array, _)| *array);
        &self.instances[declared].name
    }

    /// True if this array of components is to be made element by element; arrays of records are values, which have one type.
    pub(crate) fn is_made_apart(&self, inst: InstId, local: &LocalClass) -> bool {
        !self.apart.is_empty()
            && !self.instances[inst].dims.is_empty()
            && self.table.class(local.class).def.kind != ClassKind::Record
            && self.apart.contains(&path(&self.instances, inst))
    }

    /// Makes the elements of the array, each an instance.
    pub(crate) fn make_parts(
        &mut self,
        array: InstId,
        local: &LocalClass,
        shape: &Rc<Shape>,
        mods: &Mods,
        declaration: &Component,
    ) -> Result<(), Reported> {
        let Some(parent) = self.instances[array].parent else { return Ok(()) };
        let dims = self.instances[array].dims.clone();
        let count: usize = dims.iter().product();
        let (name, span) = (self.instances[array].name.clone(), self.instances[array].span);
        if count > MAX_PARTS {
            let message = format!("the elements of `{name}` differ in structure, and there are more than {MAX_PARTS}");
            self.table.report(Diagnostic::error(Code::Limit, message).at(span, ""));
            return Err(Reported);
        }
        self.instances[array].shape = Some(shape.clone());
        self.instances[array].class = Some(local.class);
        self.instances[array].kind = self.table.class(local.class).def.kind;
        self.instances[parent].children.retain(|&child| child != array);
        let protected = self.instances[array].protected;
        let mut result = Ok(());
        for k in 0..count {
            let at = subscripts_of(k, &dims);
            let text: Vec<String> = at.iter().map(|k| (k + 1).to_string()).collect();
            let part = self.new_instance(format!("{name}[{}]", text.join(",")).into(), Some(parent), span);
            self.fill(part, parent, declaration);
            self.instances[part].protected = protected;
            self.instances[part].part_of = Some((array, at));
            self.instances[array].parts.push(part);
            self.instances[parent].children.push(part);
            if self.make_component(part, local.clone(), shape.clone(), mods.clone(), declaration).is_err() {
                result = Err(Reported);
            }
        }
        result
    }

    /// The element of an array made in parts that literal subscripts name; none for other subscripts.
    pub fn part_at(&self, array: InstId, subscripts: &[Expr]) -> Option<InstId> {
        let instance = &self.instances[array];
        if instance.parts.is_empty() || subscripts.len() != instance.dims.len() {
            return None;
        }
        let mut position = 0;
        for (subscript, &size) in subscripts.iter().zip(&instance.dims) {
            let ExprKind::Integer(k) = subscript.kind else { return None };
            let k = usize::try_from(k - 1).ok().filter(|&k| k < size)?;
            position = position * size + k;
        }
        instance.parts.get(position).copied()
    }

    /// A reference into an array made in parts whose subscripts name none of them.
    pub(crate) fn no_such_part(&mut self, array: InstId, subscripts: &[Expr], span: Span) -> Reported {
        let instance = &self.instances[array];
        let (name, dims) = (instance.name.clone(), instance.dims.clone());
        let outside = subscripts.iter().zip(&dims).find_map(|(subscript, &size)| match subscript.kind {
            ExprKind::Integer(k) if k < 1 || k as usize > size => Some((k, size)),
            _ => None,
        });
        let diagnostic = match outside {
            Some((k, size)) => {
                Diagnostic::error(Code::ArrayShape, format!("subscript {k} of `{name}` is outside 1..{size}"))
            }
            None => {
                let message =
                    format!("the elements of `{name}` differ in structure: its subscripts must be known here");
                Diagnostic::error(Code::NotStructural, message)
            }
        };
        self.table.report(diagnostic.at(span, ""));
        Reported
    }

    /// True if a modification speaks of all elements of an array made in parts.
    pub(crate) fn is_for_parts(&self, applied: &Applied) -> bool {
        !self.apart.is_empty() && applied.spread.iter().any(|&inst| self.instances[inst].part_of.is_some())
    }

    /// Of the value that a modification gives to all elements: what it is for the parts in `spread`.  A value without the sizes of
    /// the array is left as it is.
    pub(crate) fn value_for_parts(&mut self, expr: &Arc<Expr>, applied: &Applied) -> Result<Value, Reported> {
        // Computed once for all of them, if it is not only a guess.
        let place = (Arc::as_ptr(expr) as usize, applied.scope);
        let known = self.values_for_parts.get(&place).filter(|_| self.guessed.is_none());
        let value = match known {
            Some((_, value)) => value.clone(),
            None => self.evaluate(expr, applied.scope, &Env::default())?,
        };
        if self.guessed.is_none() {
            self.values_for_parts.insert(place, (expr.clone(), value.clone()));
        }
        if value.shape().is_empty() {
            return Ok(value);
        }
        self.taken_apart(value, &applied.spread, expr.span)
    }

    fn taken_apart(&mut self, value: Value, spread: &[InstId], span: Span) -> Result<Value, Reported> {
        let Some((&first, rest)) = spread.split_first() else { return Ok(value) };
        match self.instances[first].part_of.clone() {
            Some((array, at)) => {
                let dims = self.instances[array].dims.clone();
                let shape = value.shape();
                if shape.get(..dims.len()) != Some(&dims[..]) {
                    let name = self.path_of_arrays(array);
                    let message = format!("`{name}` has the sizes {dims:?}, but this value has {shape:?}");
                    self.table.report(Diagnostic::error(Code::ArrayShape, message).at(span, ""));
                    return Err(Reported);
                }
                let mut element = value;
                for k in at {
                    // Its sizes have been looked at.
                    let Some(inner) = element.items().get(k).cloned() else { return Err(Reported) };
                    element = inner;
                }
                self.taken_apart(element, rest, span)
            }
            None => self.below(value, self.instances[first].dims.len(), rest, span),
        }
    }

    /// Goes on below `depth` dimensions.
    fn below(&mut self, value: Value, depth: usize, rest: &[InstId], span: Span) -> Result<Value, Reported> {
        match value {
            Value::Array(items) if depth > 0 => items
                .iter()
                .map(|item| self.below(item.clone(), depth - 1, rest, span))
                .collect::<Result<_, _>>()
                .map(Value::array),
            value => self.taken_apart(value, rest, span),
        }
    }

    /// Position of the value set from outside for a parameter, the last one said; one for an array made in parts is for all of them.
    pub fn override_of(&self, inst: InstId) -> Option<usize> {
        let instance = &self.instances[inst];
        let settable = instance.variability == Variability::Parameter
            && instance.primitive.as_ref().is_some_and(|primitive| !primitive.is_final);
        if self.overrides.is_empty() || !settable {
            return None;
        }
        let own = path(&self.instances, inst);
        let whole = self.path_of_arrays(inst);
        self.overrides.iter().rposition(|o| o.path == own || o.path == whole)
    }

    /// The path without the subscripts of parts.
    pub fn path_of_arrays(&self, inst: InstId) -> String {
        let names = chain(&self.instances, inst).into_iter().map(|id| self.declared_name(id).as_ref());
        names.filter(|name| !name.is_empty()).collect::<Vec<_>>().join(".")
    }

    /// Sizes of the arrays around an instance and its own, those made in parts among them.
    pub(crate) fn sizes_as_written(&self, inst: InstId) -> Vec<usize> {
        let sizes = |id: InstId| match &self.instances[id].part_of {
            Some((array, _)) => self.instances[*array].dims.clone(),
            None => self.instances[id].dims.clone(),
        };
        chain(&self.instances, inst).into_iter().flat_map(sizes).collect()
    }

    /// A value set from outside for all elements of the arrays around a parameter, as the parameter has it: with its own sizes only.
    pub(crate) fn given_value_of(&mut self, inst: InstId, value: Value, span: Span) -> Result<Value, Reported> {
        let own = self.instances[inst].dims.clone();
        if value.shape() == own {
            return Ok(value);
        }
        let around: Vec<InstId> = chain(&self.instances, inst)
            .into_iter()
            .filter(|&id| id != inst && self.instances[id].is_array())
            .collect();
        let value = self.taken_apart(value, &around, span)?;
        let rank = value.shape().len() - own.len();
        match first_if_uniform(&value, rank) {
            Some(same) => Ok(same),
            None => Err(self.set_by_element(inst, span)),
        }
    }

    /// True if elements of the arrays around a parameter are set from outside one by one.
    pub(crate) fn is_set_by_element(&self, inst: InstId) -> bool {
        if self.overrides.is_empty() {
            return false;
        }
        let whole = self.path_of_arrays(inst);
        let subscripted = |path: &str| path.rsplit_once('.').is_some_and(|(around, _)| around.contains('['));
        self.overrides.iter().any(|o| subscripted(&o.path) && without_subscripts(&o.path) == whole)
            && chain(&self.instances, inst).into_iter().any(|id| id != inst && !self.instances[id].dims.is_empty())
    }

    /// Values set from outside that differ between the elements of the arrays around a parameter.
    pub(crate) fn set_by_element(&mut self, inst: InstId, span: Span) -> Reported {
        let around = chain(&self.instances, inst).into_iter().filter(|&id| id != inst);
        let arrays: Vec<String> =
            around.filter(|&id| !self.instances[id].dims.is_empty()).map(|id| path(&self.instances, id)).collect();
        self.differing.extend(arrays);
        let name = path(&self.instances, inst);
        self.not_structural(span, format!("the values set for `{name}` differ between the elements of an array"));
        Reported
    }
}

/// The path of a name without what stands in brackets.
fn without_subscripts(path: &str) -> String {
    let mut depth = 0;
    path.chars()
        .filter(|&c| {
            depth += i32::from(c == '[');
            let outside = depth == 0;
            depth -= i32::from(c == ']');
            outside
        })
        .collect()
}

/// Subscripts from 0 of element `k`, the last one fastest.
fn subscripts_of(k: usize, dims: &[usize]) -> Vec<usize> {
    let mut rest = k;
    let mut at: Vec<usize> = dims
        .iter()
        .rev()
        .map(|&size| {
            let own = rest % size;
            rest /= size;
            own
        })
        .collect();
    at.reverse();
    at
}
