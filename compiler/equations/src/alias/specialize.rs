//! Templates adapted to what their slots have turned out to read.
//!
//! When an operand becomes zero, or two slots come to read the same variable, the template is rewritten with the slot
//! gone, so that later passes find each variable in one slot only.  The symbolic work is done once for each template and
//! pattern of changes; equations only look the result up.

use hyd_symbolic::{SlotId, TemplateId, Templates, canonical, substitute};
use rustc_hash::FxHashMap;

/// What happens to a slot.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Change {
    /// It stays.
    Keep,
    /// It reads 0.
    Zero,
    /// It reads what another slot reads, or the negative of it.
    Same {
        /// The other slot (which stays).
        slot: SlotId,
        /// The negative.
        negated: bool,
    },
}

/// An adapted template, and for each of its slots the slot of the original.
pub(crate) type Adapted = (TemplateId, Box<[SlotId]>);

/// Adapted templates found so far.
#[derive(Default)]
pub(crate) struct Specializer {
    known: FxHashMap<TemplateId, FxHashMap<Box<[Change]>, Adapted>>,
}

impl Specializer {
    /// The template after the changes (one per slot).
    pub(crate) fn adapt(&mut self, templates: &mut Templates, template: TemplateId, changes: &[Change]) -> &Adapted {
        let known = self.known.entry(template).or_default();
        if !known.contains_key(changes) {
            known.insert(changes.into(), rewrite(templates, template, changes));
        }
        &known[changes]
    }
}

fn rewrite(templates: &mut Templates, template: TemplateId, changes: &[Change]) -> Adapted {
    let old = templates.get(template);
    let arena = &mut templates.arena;
    let values: Vec<_> = changes
        .iter()
        .enumerate()
        .map(|(k, change)| match *change {
            Change::Keep => arena.slot(SlotId(k as u32)),
            Change::Zero => arena.constant(0.0),
            Change::Same { slot, negated } => {
                let same = arena.slot(slot);
                if negated { arena.neg(same) } else { same }
            }
        })
        .collect();
    let value = |slot: SlotId| values[slot.0 as usize];
    let left = substitute(arena, old.left, &value);
    let right = substitute(arena, old.right, &value);
    let (new, slots) = canonical(arena, left, right);
    (templates.intern(new), slots.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyd_symbolic::{Template, print_template};

    #[test]
    fn slots_vanish_and_merge() {
        let mut templates = Templates::new();
        let arena = &mut templates.arena;
        let [a, b, c] = [0, 1, 2].map(|k| arena.slot(SlotId(k)));
        let left = arena.mul(a, b);
        let template = templates.intern(Template { left, right: c, arity: 3 });
        let mut specializer = Specializer::default();
        let mut text = |changes: [Change; 3]| {
            let (new, slots) = specializer.adapt(&mut templates, template, &changes).clone();
            let print = print_template(&templates.arena, &templates.get(new), &|slot| format!("{slot}"));
            (print, slots.to_vec())
        };
        let same = Change::Same { slot: SlotId(0), negated: true };
        assert_eq!(text([Change::Zero, Change::Keep, Change::Keep]), ("0 = s0".into(), vec![SlotId(2)]));
        assert_eq!(text([Change::Keep, Change::Keep, same]), ("s0*s1 = -s0".into(), vec![SlotId(0), SlotId(1)]));
    }
}
