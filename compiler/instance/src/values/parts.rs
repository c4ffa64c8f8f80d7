//! Arrays of components whose elements differ in size or structure: one instance an element.
//!
//! An array of components is one instance as long as its elements share their structure.  A parameter that decides sizes,
//! conditions or equations may have another value in each element (Modelica 3.6, section 7.2.5).  Such an array is noted in
//! [`Scopes::differing`] when the value is asked for; the model is then instantiated anew with the array made *in parts*: the
//! array itself is only a name with sizes, its elements `c[1]`, `c[2]`, ... are components of their own.  References take the part
//! that their subscripts name (`part_text`), values of modifications are taken apart by [`Scopes::taken_apart`].

use hyd_source::{Code, Reported, Span};

use crate::instantiation::instance::{InstId, chain};
use crate::instantiation::scopes::Scopes;
use crate::values::value::{Value, first_if_uniform};

impl Scopes<'_> {
    /// A value for all elements of the arrays in `spread`: what it is for the parts among them.
    pub(crate) fn taken_apart(&mut self, value: Value, spread: &[InstId], span: Span) -> Result<Value, Reported> {
        let Some((&first, rest)) = spread.split_first() else { return Ok(value) };
        match self.instances[first].part_of.clone() {
            Some((array, at)) => {
                let dims = self.instances[array].dims.clone();
                let shape = value.shape();
                if shape.get(..dims.len()) != Some(&dims[..]) {
                    let name = self.path_of_arrays(array);
                    let message = format!("`{name}` has the sizes {dims:?}, but this value has {shape:?}");
                    return Err(self.error(Code::ArrayShape, span, message));
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
                .map(|list| Value::array_of(list, || items.sizes())),
            value => self.taken_apart(value, rest, span),
        }
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
}
