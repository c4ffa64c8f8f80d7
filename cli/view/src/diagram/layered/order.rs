//! The order of boxes within layers, and their heights.
//!
//! Lines over several layers get a point in each.  The order follows the mean of the neighbours', and heights the same under the least distances, which are
//! kept by pooling (R. E. Barlow and others, "Statistical inference under order restrictions", 1972).

use std::collections::BTreeMap;

use super::graph::Graph;
use crate::diagram::End;

/// Least distance of two boxes of a layer.
pub(super) const APART: f64 = 16.0;
/// Least distance of two lines through a layer.
const LINES_APART: f64 = 8.0;
/// Height that a port needs.
const PORT: f64 = 8.0;
/// Sweeps over the layers that look for an order, and for heights.
const SWEEPS: usize = 16;

/// A box or a point that a line passes.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) layer: usize,
    /// None: a point of a line.
    pub(super) part: Option<usize>,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) y: f64,
}

/// A piece of an edge between two neighbouring layers, or on one side of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) edge: usize,
    pub(super) from: usize,
    pub(super) to: usize,
}

/// The layout in the making.
pub(super) struct Work<'g> {
    pub(super) graph: &'g Graph,
    pub(super) forward: Vec<bool>,
    pub(super) nodes: Vec<Node>,
    /// Of each box its node.
    pub(super) node_of: BTreeMap<usize, usize>,
    /// Nodes of each layer from top to bottom.
    pub(super) layers: Vec<Vec<usize>>,
    pub(super) pieces: Vec<Piece>,
    /// Edges from a box to itself.
    pub(super) own_loops: Vec<usize>,
    /// Ports on the left and on the right of each box, from top to bottom.
    pub(super) sides: BTreeMap<(usize, bool), Vec<End>>,
}

impl<'g> Work<'g> {
    pub(super) fn new(graph: &'g Graph, forward: Vec<bool>, layer: &[usize], is_connected: &[bool]) -> Self {
        let mut work = Self {
            graph,
            forward,
            nodes: Vec::new(),
            node_of: BTreeMap::new(),
            layers: Vec::new(),
            pieces: Vec::new(),
            own_loops: Vec::new(),
            sides: BTreeMap::new(),
        };
        for (part, &(width, height)) in graph.boxes.iter().enumerate().filter(|(part, _)| is_connected[*part]) {
            let node = work.add(Node { layer: layer[part], part: Some(part), width, height, y: 0.0 });
            work.node_of.insert(part, node);
        }
        for (edge, (a, b)) in graph.edges.iter().enumerate() {
            if a.part == b.part {
                work.own_loops.push(edge);
                continue;
            }
            let (from, to) = if work.forward[edge] { (a.part, b.part) } else { (b.part, a.part) };
            let (mut last, end) = (work.node_of[&from], work.node_of[&to]);
            for layer in layer[from] + 1..layer[to] {
                let point = work.add(Node { layer, part: None, width: 0.0, height: 0.0, y: 0.0 });
                work.pieces.push(Piece { edge, from: last, to: point });
                last = point;
            }
            work.pieces.push(Piece { edge, from: last, to: end });
        }
        work
    }

    fn add(&mut self, node: Node) -> usize {
        if self.layers.len() <= node.layer {
            self.layers.resize(node.layer + 1, Vec::new());
        }
        self.layers[node.layer].push(self.nodes.len());
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// The ends of an edge in the direction that it is laid out in.
    pub(super) fn ends(&self, edge: usize) -> (End, End) {
        let (a, b) = self.graph.edges[edge];
        if self.forward[edge] { (a, b) } else { (b, a) }
    }

    /// Ports of each side, and boxes as high as these need.
    pub(super) fn size(&mut self) {
        for edge in 0..self.graph.edges.len() {
            let (from, to) = self.ends(edge);
            let is_loop = from.part == to.part;
            for (end, is_left) in [(from, false), (to, !is_loop)] {
                let side = self.sides.entry((end.part, is_left)).or_default();
                if !side.contains(&end) {
                    side.push(end);
                }
            }
        }
        for ((part, _), ends) in &self.sides {
            if let Some(&node) = self.node_of.get(part) {
                let own = &mut self.nodes[node];
                own.height = own.height.max((ends.len() as f64 + 0.5) * PORT);
            }
        }
    }

    /// Neighbours of each node in the layer before it (or behind it).
    fn neighbours(&self, before: bool) -> Vec<Vec<usize>> {
        let mut all = vec![Vec::new(); self.nodes.len()];
        for piece in &self.pieces {
            match before {
                true => all[piece.to].push(piece.from),
                false => all[piece.from].push(piece.to),
            }
        }
        all
    }

    fn crossings(&self) -> usize {
        let rank = self.ranks();
        let mut count = 0;
        let mut between: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
        for piece in &self.pieces {
            between.entry(self.nodes[piece.from].layer).or_default().push((rank[piece.from], rank[piece.to]));
        }
        for pairs in between.values() {
            for (k, one) in pairs.iter().enumerate() {
                count += pairs[..k]
                    .iter()
                    .filter(|own| (own.0 < one.0 && own.1 > one.1) || (own.0 > one.0 && own.1 < one.1))
                    .count();
            }
        }
        count
    }

    fn ranks(&self) -> Vec<usize> {
        let mut rank = vec![0; self.nodes.len()];
        for layer in &self.layers {
            layer.iter().enumerate().for_each(|(k, &node)| rank[node] = k);
        }
        rank
    }

    /// Finds an order with few crossings.
    pub(super) fn order(&mut self) {
        let (before, behind) = (self.neighbours(true), self.neighbours(false));
        let mut best = (self.crossings(), self.layers.clone());
        for sweep in 0..SWEEPS {
            let down = sweep % 2 == 0;
            let neighbours = if down { &before } else { &behind };
            let count = self.layers.len();
            for k in 0..count {
                let layer = if down { k } else { count - 1 - k };
                let rank = self.ranks();
                let mean = |node: usize| {
                    let own = &neighbours[node];
                    match own.len() {
                        0 => rank[node] as f64,
                        many => own.iter().map(|&other| rank[other] as f64).sum::<f64>() / many as f64,
                    }
                };
                self.layers[layer].sort_by(|&a, &b| mean(a).total_cmp(&mean(b)));
            }
            let crossings = self.crossings();
            if crossings < best.0 {
                best = (crossings, self.layers.clone());
            }
        }
        self.layers = best.1;
    }

    /// Heights of nodes: near those of their neighbours, as far apart as they must be.
    pub(super) fn heights(&mut self) {
        for layer in &self.layers {
            let mut y = 0.0;
            for &node in layer {
                self.nodes[node].y = y - self.nodes[node].height / 2.0;
                y -= self.nodes[node].height + APART;
            }
        }
        let (before, behind) = (self.neighbours(true), self.neighbours(false));
        for sweep in 0..SWEEPS {
            self.sort_ports();
            let count = self.layers.len();
            for k in 0..count {
                let down = sweep % 2 == 0;
                let layer = self.layers[if down { k } else { count - 1 - k }].clone();
                let wanted: Vec<f64> = layer
                    .iter()
                    .map(|&node| {
                        let (first, second) = if down { (&before, &behind) } else { (&behind, &before) };
                        // Towards the end both sides count.
                        let own: Vec<usize> = match first[node].is_empty() || sweep + 4 > SWEEPS {
                            true => first[node].iter().chain(&second[node]).copied().collect(),
                            false => first[node].clone(),
                        };
                        match own.len() {
                            0 => self.nodes[node].y,
                            many => own.iter().map(|&other| self.nodes[other].y).sum::<f64>() / many as f64,
                        }
                    })
                    .collect();
                self.settle(&layer, &wanted);
            }
        }
        self.sort_ports();
    }

    /// Heights as near to the wanted ones as the least distances allow.
    fn settle(&mut self, layer: &[usize], wanted: &[f64]) {
        let mut offset = vec![0.0; layer.len()];
        for k in 1..layer.len() {
            let (a, b) = (&self.nodes[layer[k - 1]], &self.nodes[layer[k]]);
            let apart = if a.part.is_some() || b.part.is_some() { APART } else { LINES_APART };
            offset[k] = offset[k - 1] + (a.height + b.height) / 2.0 + apart;
        }
        // Downwards y falls, so that moved up by their offsets they must not rise.
        let mut pools: Vec<(f64, usize)> = Vec::new();
        for k in 0..layer.len() {
            pools.push((wanted[k] + offset[k], 1));
            while let [.., (above, many), (own, count)] = pools.as_slice()
                && own > above
            {
                let joined = (above * *many as f64 + own * *count as f64) / (many + count) as f64;
                let size = many + count;
                pools.truncate(pools.len() - 2);
                pools.push((joined, size));
            }
        }
        let mut k = 0;
        for (value, count) in pools {
            for _ in 0..count {
                self.nodes[layer[k]].y = value - offset[k];
                k += 1;
            }
        }
    }

    /// Ports of a side in the order of what they lead to.
    fn sort_ports(&mut self) {
        let mut aims: BTreeMap<(End, bool), (f64, usize)> = BTreeMap::new();
        for piece in &self.pieces {
            let (from, to) = self.ends(piece.edge);
            if self.nodes[piece.from].part == Some(from.part) {
                let aim = aims.entry((from, false)).or_default();
                *aim = (aim.0 + self.nodes[piece.to].y, aim.1 + 1);
            }
            if self.nodes[piece.to].part == Some(to.part) {
                let aim = aims.entry((to, true)).or_default();
                *aim = (aim.0 + self.nodes[piece.from].y, aim.1 + 1);
            }
        }
        for ((_, is_left), ends) in &mut self.sides {
            let aim =
                |end: &End| aims.get(&(*end, *is_left)).map_or(f64::NEG_INFINITY, |(sum, many)| sum / *many as f64);
            ends.sort_by(|a, b| aim(b).total_cmp(&aim(a)));
        }
    }
}
