//! Solution order: strongly connected components and the block lower triangular (BLT) form.
//!
//! Given a matching, equation r depends on equation s if r holds the unknown that s determines.  The strongly
//! connected components of this graph must be solved simultaneously; in dependency order they make the incidence
//! block lower triangular.  Components by Tarjan 1972, *Depth-first search and linear graph algorithms*, applied to
//! matched equations as in Duff & Reid 1978, *An implementation of Tarjan's algorithm for the block triangularization
//! of a matrix*; with an explicit stack, linear in nodes and edges.

use crate::blocks::BlockPlan;
use crate::graph::{Column, Incidence, Row};
use crate::matching::Matching;
use std::fmt;

/// A directed graph on the nodes `0..node_count`, as lists of successors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Digraph {
    starts: Vec<u32>,
    targets: Vec<u32>,
}

impl Default for Digraph {
    fn default() -> Self {
        Self::new()
    }
}

impl Digraph {
    /// A graph without nodes.
    pub fn new() -> Self {
        Self { starts: vec![0], targets: Vec::new() }
    }

    /// Appends a node with its successors, which may be added later.
    pub fn push_node(&mut self, successors: impl IntoIterator<Item = u32>) {
        self.targets.extend(successors);
        let end = u32::try_from(self.targets.len());
        self.starts.push(end.expect("invariant: an incidence has at most 2^32 - 1 entries"));
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The successors of a node.
    pub fn successors(&self, node: u32) -> &[u32] {
        let start = self.starts[node as usize] as usize;
        &self.targets[start..self.starts[node as usize + 1] as usize]
    }
}

/// The strongly connected components of a [`Digraph`], each after all components it has an edge into.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Component `k` holds `nodes[starts[k]..starts[k + 1]]`.
    pub starts: Vec<u32>,
    /// All nodes, component by component, ascending within each.
    pub nodes: Vec<u32>,
}

const UNSEEN: u32 = u32::MAX;

/// Work space of Tarjan's algorithm.
struct Tarjan<'a> {
    graph: &'a Digraph,
    /// Order of discovery, `UNSEEN` before it.
    number: Vec<u32>,
    /// Smallest number known to be reachable within the open component; `UNSEEN` once the component is closed.
    low: Vec<u32>,
    next_number: u32,
    /// Nodes on the path from the root, with the position of the next successor.
    path: Vec<(u32, u32)>,
    /// Discovered nodes whose component is not closed.
    open: Vec<u32>,
    result: Components,
}

/// The strongly connected components, dependencies (successors) first.
///
/// Ties are broken by number: the search starts from the smallest unseen node and follows successors as listed.
pub fn strongly_connected_components(graph: &Digraph) -> Components {
    let count = graph.node_count();
    let mut tarjan = Tarjan {
        graph,
        number: vec![UNSEEN; count],
        low: vec![UNSEEN; count],
        next_number: 0,
        path: Vec::new(),
        open: Vec::new(),
        result: Components { starts: vec![0], nodes: Vec::with_capacity(count) },
    };
    for node in 0..count as u32 {
        if tarjan.number[node as usize] == UNSEEN {
            tarjan.search(node);
        }
    }
    tarjan.result
}

impl Tarjan<'_> {
    fn search(&mut self, root: u32) {
        self.discover(root);
        while let Some((node, position)) = self.path.last_mut() {
            let node = *node;
            match self.graph.successors(node).get(*position as usize) {
                Some(&next) => {
                    *position += 1;
                    if self.number[next as usize] == UNSEEN {
                        self.discover(next);
                    } else if self.low[next as usize] != UNSEEN {
                        self.lower(node, self.number[next as usize]);
                    }
                }
                None => {
                    self.path.pop();
                    let low = self.low[node as usize];
                    if low == self.number[node as usize] {
                        self.close(node);
                    } else if let Some(&(parent, _)) = self.path.last() {
                        self.lower(parent, low);
                    }
                }
            }
        }
    }

    fn discover(&mut self, node: u32) {
        self.number[node as usize] = self.next_number;
        self.low[node as usize] = self.next_number;
        self.next_number += 1;
        self.path.push((node, 0));
        self.open.push(node);
    }

    fn lower(&mut self, node: u32, value: u32) {
        let low = &mut self.low[node as usize];
        *low = (*low).min(value);
    }

    /// Moves the component whose first discovered node is `first` from the open nodes to the result.
    fn close(&mut self, first: u32) {
        let start = self.result.nodes.len();
        while let Some(node) = self.open.pop() {
            self.low[node as usize] = UNSEEN;
            self.result.nodes.push(node);
            if node == first {
                break;
            }
        }
        self.result.nodes[start..].sort_unstable();
        self.result.starts.push(self.result.nodes.len() as u32);
    }
}

/// An equation without an unknown: the system has no solution order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnmatchedRow(pub Row);

impl fmt::Display for UnmatchedRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is not matched to any unknown", self.0)
    }
}

impl std::error::Error for UnmatchedRow {}

/// The block lower triangular form: blocks in the order in which they can be solved.
///
/// Every row must be matched.  Unmatched columns are taken as known, so they cause no dependency; a caller that
/// wants a square system asks [`Matching::is_perfect`] first.  Blocks come in the order of a depth-first search from
/// the smallest row, dependencies first; rows within a block ascend.
pub fn block_order(incidence: &Incidence, matching: &Matching) -> Result<BlockPlan, UnmatchedRow> {
    if let Some(row) = matching.unmatched_rows().next() {
        return Err(UnmatchedRow(row));
    }
    let mut graph = Digraph::new();
    for row in incidence.rows() {
        let owners = incidence.row(row).iter();
        let owners = owners.filter_map(|&column| matching.row_of_column[column]);
        graph.push_node(owners.filter(|&owner| owner != row).map(|owner| owner.0));
    }
    let Components { starts, nodes } = strongly_connected_components(&graph);
    let rows: Vec<Row> = nodes.into_iter().map(Row).collect();
    let partner =
        |row: &Row| -> Column { matching.column_of_row[*row].expect("invariant: every row is matched, checked above") };
    let columns = rows.iter().map(partner).collect();
    let plan = BlockPlan { starts, rows, columns };
    debug_assert_eq!(crate::verify::check_blocks(incidence, matching, &plan), Ok(()));
    Ok(plan)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Block;
    use crate::brute_force::{any_incidence_square, transitive_closure};
    use crate::maximum_matching::maximum_matching;
    use proptest::prelude::*;

    fn graph_of(edges: &[Vec<bool>]) -> Digraph {
        let mut graph = Digraph::new();
        for row in edges {
            let successors = (0..row.len() as u32).filter(|&k| row[k as usize]);
            graph.push_node(successors);
        }
        graph
    }

    proptest! {
        /// Two nodes share a component exactly if each reaches the other; components follow what they reach.
        #[test]
        fn components_agree_with_the_transitive_closure(
            edges in proptest::collection::vec(proptest::collection::vec(proptest::bool::weighted(0.2), 8), 8)
        ) {
            let components = strongly_connected_components(&graph_of(&edges));
            let reach = transitive_closure(&edges);
            let mut place = [usize::MAX; 8];
            for k in 0..components.starts.len() - 1 {
                let range = components.starts[k] as usize..components.starts[k + 1] as usize;
                prop_assert!(components.nodes[range.clone()].is_sorted());
                for &node in &components.nodes[range] {
                    place[node as usize] = k;
                }
            }
            for a in 0..8 {
                for b in 0..8 {
                    let mutual = a == b || (reach[a][b] && reach[b][a]);
                    prop_assert_eq!(place[a] == place[b], mutual);
                    prop_assert!(!reach[a][b] || place[b] <= place[a]);
                }
            }
        }

        /// The blocks are those of the definition, whatever the matching: same sets of rows and columns.
        #[test]
        fn blocks_agree_with_the_definition(incidence in any_incidence_square(7)) {
            let matching = maximum_matching(&incidence, None);
            prop_assert!(matching.is_perfect());
            let plan = block_order(&incidence, &matching).expect("perfect");
            let depends = |row: Row, other: Row| {
                matching.column_of_row[other].is_some_and(|c| incidence.entry(row, c).is_some())
            };
            let edges: Vec<Vec<bool>> = incidence.rows()
                .map(|row| incidence.rows().map(|other| depends(row, other)).collect())
                .collect();
            let reach = transitive_closure(&edges);
            let place = plan.block_of_row();
            for a in incidence.rows() {
                for b in incidence.rows() {
                    let (i, j) = (a.0 as usize, b.0 as usize);
                    prop_assert_eq!(place[a] == place[b], i == j || (reach[i][j] && reach[j][i]));
                    prop_assert!(!reach[i][j] || place[b] <= place[a]);
                }
            }
        }
    }

    #[test]
    fn loop_behind_an_explicit_equation() {
        let text = "4 rows, 4 columns\neq0: v0 v1\neq1: v0 v1 v2\neq2: v2\neq3: v1 v3\n";
        let incidence: Incidence = text.parse().expect("text");
        let matching = maximum_matching(&incidence, None);
        let plan = block_order(&incidence, &matching).expect("perfect");
        let (rows, _) = plan.block(Block(1));
        assert_eq!(rows, [Row(0), Row(1)]);
        let expected = "block0: eq2=v2\nblock1: eq0=v0 eq1=v1\nblock2: eq3=v3\n";
        assert_eq!(plan.to_string(), expected);
    }

    #[test]
    fn unmatched_rows_are_refused_and_unmatched_columns_are_known() {
        let incidence: Incidence = "1 rows, 2 columns\neq0: v0 v1\n".parse().expect("text");
        let mut matching = Matching::empty(&incidence);
        assert_eq!(block_order(&incidence, &matching), Err(UnmatchedRow(Row(0))));
        matching.assign(Row(0), Column(1));
        let plan = block_order(&incidence, &matching).expect("row is matched");
        assert_eq!(plan.to_string(), "block0: eq0=v1\n");
    }

    /// One chain (1e5 blocks) and one ring (a single block): no recursion, linear time.
    #[test]
    fn chain_and_ring_of_1e5_rows() {
        let n = 100_000_u32;
        for (ring, blocks) in [(false, n as usize), (true, 1)] {
            let rows = (0..n).map(|k| {
                let mut row = vec![Column(k)];
                row.extend((k + 1 < n).then_some(Column(k + 1)));
                if ring && k + 1 == n {
                    row.insert(0, Column(0));
                }
                row
            });
            let incidence = Incidence::from_rows(n as usize, rows).expect("sorted");
            let mut matching = Matching::empty(&incidence);
            for k in 0..n {
                matching.assign(Row(k), Column(k));
            }
            let plan = block_order(&incidence, &matching).expect("perfect");
            assert_eq!(plan.len(), blocks);
        }
    }
}
