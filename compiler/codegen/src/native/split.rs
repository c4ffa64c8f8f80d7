//! Cutting a routine into functions of a size that compiles fast.
//!
//! The time of register allocation grows faster than the code, and a function of a few thousand operations already
//! amortises its call.  Cuts lie between kernels; a longer straight-line kernel that does not read what it writes is cut
//! between its stores, where values needed on both sides are computed twice.

use hyd_symbolic::{Arena, NodeId, post_order};

use crate::program::{AREAS, Address, Area, Kernel, Routine};

/// Nodes per function, beyond which a new one is begun.
const NODE_LIMIT: usize = 5000;

/// The functions of a routine, as lists of kernels.
pub(super) fn functions(arena: &Arena, routine: &Routine) -> Vec<Vec<Kernel>> {
    let mut list: Vec<Vec<Kernel>> = Vec::new();
    let mut size = usize::MAX;
    for kernel in routine.kernels.iter().filter(|kernel| kernel.count > 0 && !kernel.stores.is_empty()) {
        for (part, nodes) in parts(arena, kernel) {
            match list.last_mut() {
                Some(last) if size.saturating_add(nodes) <= NODE_LIMIT => {
                    last.push(part);
                    size += nodes;
                }
                _ => {
                    list.push(vec![part]);
                    size = nodes;
                }
            }
        }
    }
    list
}

/// The areas that some kernel writes.
pub(super) fn written(kernels: &[Kernel]) -> [bool; AREAS] {
    let mut written = [false; AREAS];
    for store in kernels.iter().flat_map(|kernel| &kernel.stores) {
        written[area(&store.to) as usize] = true;
    }
    written
}

/// A kernel in pieces of bounded size where that is possible, each with its number of nodes.
fn parts(arena: &Arena, kernel: &Kernel) -> Vec<(Kernel, usize)> {
    let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
    let nodes = post_order(arena, &roots).len() + roots.len();
    let writes = written(std::slice::from_ref(kernel));
    let reads_own = kernel.slots.iter().any(|slot| writes[area(slot) as usize]);
    if nodes <= NODE_LIMIT || kernel.count > 1 || reads_own {
        return vec![(kernel.clone(), nodes)];
    }
    let pieces = nodes.div_ceil(NODE_LIMIT);
    let chunk = kernel.stores.len().div_ceil(pieces);
    let piece = |stores: &[crate::program::Store]| {
        let roots: Vec<NodeId> = stores.iter().map(|store| store.value).collect();
        let size = post_order(arena, &roots).len() + roots.len();
        (Kernel { count: 1, slots: kernel.slots.clone(), stores: stores.to_vec() }, size)
    };
    kernel.stores.chunks(chunk).map(piece).collect()
}

fn area(address: &Address) -> Area {
    match *address {
        Address::Fixed { area, .. } | Address::Affine { area, .. } | Address::Table { area, .. } => area,
    }
}
