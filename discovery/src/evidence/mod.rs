//! What a fit that is done says of what was not tried: projections onto what nuisances cannot imitate, promises, places, and proof on shots that
//! were not fitted.

pub(crate) mod further;
pub(crate) mod hypothesis;
pub(crate) mod location;
pub(crate) mod missing;
pub(crate) mod power;
pub(crate) mod projection;
pub(crate) mod proof;
pub(crate) mod response;
pub(crate) mod thresholds;
