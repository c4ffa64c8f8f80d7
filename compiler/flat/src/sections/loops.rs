//! Loops of the text around equations.

use hyd_instance::Value;
use hyd_syntax::tree::Name;
use hyd_typed::Iterator;

use crate::expressions::range::Range;
use crate::expressions::value::local_of;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;

/// What surrounds an equation in the text: loops not yet entered, from the outside in.
#[derive(Clone, Default)]
pub(crate) struct Loops<'e> {
    pub(crate) iterators: Vec<&'e Iterator>,
    /// Loop variables around these that are written out, and their values.
    pub(crate) fixed: Vec<(Name, Value)>,
}

impl Flattener<'_, '_> {
    /// Enters the arrays of components around the scope and the loops of the text.
    pub(crate) fn enter_all(&mut self, cx: &mut Context, loops: &Loops<'_>) -> Result<(), Fail> {
        self.enter(cx);
        cx.names.extend(loops.fixed.iter().map(|(name, value)| (name.clone(), local_of(value.clone()))));
        self.enter_loops(cx, &loops.iterators)
    }

    /// Enters loops of the text.
    pub(crate) fn enter_loops(&mut self, cx: &mut Context, iterators: &[&Iterator]) -> Result<(), Fail> {
        for iterator in iterators {
            let range = self.range(iterator, cx)?;
            let at = cx.counter(range.count());
            let local = match range {
                Range::Steps { start, step, .. } => {
                    Local::Index(start.add_scaled(&at, step).ok_or(Fail::NeedsExpansion)?)
                }
                Range::Values(values) => {
                    if values.is_empty() {
                        Local::Index(Affine::constant(0))
                    } else {
                        let k = at.as_constant().ok_or(Fail::NeedsExpansion)?;
                        local_of(values.get(k as usize).cloned().ok_or(Fail::Reported)?)
                    }
                }
                Range::Nodes(_) => return Err(Fail::Reported),
            };
            cx.names.push((iterator.name.name.clone(), local));
        }
        Ok(())
    }
}
