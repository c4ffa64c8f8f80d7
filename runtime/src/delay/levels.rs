//! Work space of the recording: the sources at the nodes of a step, of its halves, and so on.

use super::polynomial::NODES;

/// Most halvings of a step.
const MOST_HALVINGS: usize = 10;

/// Work space of the recording.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Levels {
    /// Values at the nodes per halving.
    pub(super) levels: Vec<Vec<f64>>,
    /// Unknowns and rates at a node.
    pub(super) y: Vec<f64>,
    pub(super) yp: Vec<f64>,
}

impl Levels {
    pub(super) fn new(sites: usize, unknowns: usize) -> Self {
        let levels = if sites == 0 { 0 } else { MOST_HALVINGS + 1 };
        Self {
            levels: (0..levels).map(|_| vec![0.0; NODES * sites]).collect(),
            y: vec![0.0; if sites == 0 { 0 } else { unknowns }],
            yp: vec![0.0; if sites == 0 { 0 } else { unknowns }],
        }
    }
}
