//! The instance tree, and beside it the constants of packages, which are made when they are named.
//!
//! The components of the model are plain data.  They are written while they are made; whoever has the tree ([`Instances::tree`]) has it as
//! it stays.  What a package or a function declares is no part of the model: it is found by names, from the first size up to the last
//! equation, so it stands in a table of its own, whose numbers begin where those of components cannot come.

use std::collections::BTreeMap;
use std::ops::Index;
use std::rc::Rc;

use hyd_index::IndexVec;

use crate::instantiation::connection_rules::ConnectionRules;
use crate::instantiation::instance::{InstId, Instance};

/// The number of the first instance of a package; components are bounded far below (see `work`).
const FIRST_OF_PACKAGES: u32 = 1 << 30;

/// The components of a model.
#[derive(Clone, Debug)]
pub struct InstanceTree {
    /// All components, in the order in which they were made.
    pub components: IndexVec<InstId, Instance>,
    /// The top model.
    pub root: InstId,
    /// What declarations say of connections.
    pub connection_rules: BTreeMap<InstId, ConnectionRules>,
}

/// Components and constants of packages by their numbers.
#[derive(Debug)]
pub struct Instances {
    tree: Rc<InstanceTree>,
    packages: Vec<Instance>,
}

impl Instances {
    /// A model of which only the top is there.
    pub(crate) fn of_root(root: Instance) -> Self {
        let mut components = IndexVec::new();
        let root = components.push(root);
        let tree = InstanceTree { components, root, connection_rules: BTreeMap::new() };
        Self { tree: Rc::new(tree), packages: Vec::new() }
    }

    /// The components of the model.
    pub fn tree(&self) -> &Rc<InstanceTree> {
        &self.tree
    }

    /// True for what a package or a function declares, and for the package itself.
    pub(crate) fn is_of_package(inst: InstId) -> bool {
        inst.0 >= FIRST_OF_PACKAGES
    }

    /// Numbers of all instances, those of packages last.
    pub(crate) fn indices(&self) -> impl Iterator<Item = InstId> + use<> {
        let of_packages = (FIRST_OF_PACKAGES..).take(self.packages.len()).map(InstId);
        self.tree.components.indices().chain(of_packages)
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.tree.components.len() + self.packages.len()
    }

    /// Adds an instance: a component where its parent is one, else of a package.
    pub(crate) fn add(&mut self, instance: Instance) -> InstId {
        if instance.parent.is_some_and(|parent| !Self::is_of_package(parent)) {
            return self.tree_mut().components.push(instance);
        }
        self.packages.push(instance);
        InstId(FIRST_OF_PACKAGES + self.packages.len() as u32 - 1)
    }

    /// An instance that is being made.
    pub(crate) fn edit(&mut self, inst: InstId) -> &mut Instance {
        match of_package(inst) {
            Some(k) => &mut self.packages[k],
            None => &mut self.tree_mut().components[inst],
        }
    }

    /// The tree while it is made.
    pub(crate) fn tree_mut(&mut self) -> &mut InstanceTree {
        Rc::get_mut(&mut self.tree).expect("invariant: all components are made before the tree is given to anybody")
    }
}

impl Index<InstId> for Instances {
    type Output = Instance;

    #[inline]
    fn index(&self, inst: InstId) -> &Instance {
        match of_package(inst) {
            Some(k) => &self.packages[k],
            None => &self.tree.components[inst],
        }
    }
}

/// The place among the instances of packages.
fn of_package(inst: InstId) -> Option<usize> {
    inst.0.checked_sub(FIRST_OF_PACKAGES).map(|k| k as usize)
}
