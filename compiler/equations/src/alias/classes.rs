//! Classes of variables that are equal up to sign (union-find with parity).
//!
//! Each variable points towards the root of its class and knows whether it is the root's negative (Galler and Fischer
//! 1964, with path halving replaced by full compression; weighted by size, Tarjan 1975).  A class may have a fixed value,
//! kept at the root.

use hyd_flat::VarId;
use hyd_index::{IndexVec, TypedIndex};

/// The classes of all scalar variables.
pub(crate) struct Classes {
    /// Next variable towards the root, with the sign of that step.
    parent: IndexVec<VarId, (VarId, bool)>,
    size: IndexVec<VarId, u32>,
    /// Value of the class, for roots.
    value: IndexVec<VarId, Option<f64>>,
    path: Vec<VarId>,
}

impl Classes {
    /// Every variable alone.
    pub(crate) fn new(count: usize) -> Self {
        Self {
            parent: IndexVec::from_vec((0..count).map(|k| (VarId::new(k), false)).collect()),
            size: IndexVec::filled(1, count),
            value: IndexVec::filled(None, count),
            path: Vec::new(),
        }
    }

    /// The root of a variable's class, and whether the variable is the root's negative.
    pub(crate) fn find(&mut self, v: VarId) -> (VarId, bool) {
        self.path.clear();
        let mut at = v;
        while self.parent[at].0 != at {
            self.path.push(at);
            at = self.parent[at].0;
        }
        let mut negated = false;
        while let Some(step) = self.path.pop() {
            negated ^= self.parent[step].1;
            self.parent[step] = (at, negated);
        }
        (at, negated)
    }

    /// The fixed value of a class.
    pub(crate) fn value_of_root(&self, root: VarId) -> Option<f64> {
        self.value[root]
    }

    /// Notes `v = w` or `v = -w`; false if that follows already or contradicts.
    pub(crate) fn equate(&mut self, v: VarId, w: VarId, opposite: bool) -> bool {
        let ((a, flip_v), (b, flip_w)) = (self.find(v), self.find(w));
        if a == b || (self.value[a].is_some() && self.value[b].is_some()) {
            return false;
        }
        let (large, small) = if self.size[a] >= self.size[b] { (a, b) } else { (b, a) };
        let negated = opposite ^ flip_v ^ flip_w;
        let signed = |value: f64| if negated { -value } else { value };
        self.value[large] = self.value[large].or(self.value[small].map(signed));
        self.parent[small] = (large, negated);
        self.size[large] += self.size[small];
        true
    }

    /// Notes `v = value`; false if the class has a value already.
    pub(crate) fn fix(&mut self, v: VarId, value: f64) -> bool {
        let (root, negated) = self.find(v);
        if self.value[root].is_some() {
            return false;
        }
        self.value[root] = Some(if negated { -value } else { value });
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_multiply_along_chains() {
        let [a, b, c, d] = [0, 1, 2, 3].map(VarId);
        let mut classes = Classes::new(4);
        assert!(classes.equate(a, b, true) && classes.equate(b, c, true) && classes.equate(d, c, false));
        assert!(!classes.equate(a, d, false), "follows");
        assert!(!classes.equate(a, b, false), "contradicts");
        assert!(classes.fix(b, 2.0) && !classes.fix(a, 1.0));
        let mut value = |v| {
            let (root, negated) = classes.find(v);
            let value = classes.value_of_root(root).expect("fixed");
            if negated { -value } else { value }
        };
        assert_eq!([a, b, c, d].map(&mut value), [-2.0, 2.0, -2.0, -2.0]);
    }
}
