//! What is in progress while a model is made flat: the flattener, drafts, loops and slots, equations on their way into the model.

pub(crate) mod context;
pub(crate) mod draft;
pub(crate) mod emit;
pub(crate) mod flattener;
pub(crate) mod form;
pub(crate) mod index;
pub(crate) mod made;
pub(crate) mod node;
pub(crate) mod steps;
pub(crate) mod typing;
pub(crate) mod unit_claim;
