//! A layered layout of boxes with ports: parts from left to right along their connections, lines at right angles.
//!
//! After K. Sugiyama, S. Tagawa, M. Toda, "Methods for visual understanding of hierarchical system structures" (1981): circles are cut, each box gets
//! a layer by the longest way to it, lines over several layers get a point in each, the order within layers follows the neighbours' (their mean),
//! and heights the same under the least distances, which are kept by pooling (R. E. Barlow and others, 1972).  A connector that is connected to
//! both sides is drawn on both.

use std::collections::BTreeMap;

use super::End;
use super::geometry::Point;

/// Least distance of two boxes of a layer.
const APART: f64 = 16.0;
/// Least distance of two lines through a layer.
const LINES_APART: f64 = 8.0;
/// Height that a port needs.
const PORT: f64 = 8.0;
/// Width of a channel between layers without lines, and of each line in it.
const CHANNEL: f64 = 22.0;
const TRACK: f64 = 5.0;
/// Sweeps over the layers that look for an order, and for heights.
const SWEEPS: usize = 16;
/// Width that boxes without connections fill before a new row begins.
const LEAST_WIDTH: f64 = 260.0;

/// What is to be laid out.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    /// Least width and height of each box.
    pub(crate) boxes: Vec<(f64, f64)>,
    pub(crate) edges: Vec<(End, End)>,
}

/// Where a port of a box is drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Spot {
    pub(crate) end: End,
    pub(crate) at: Point,
    /// On the left of its box.
    pub(crate) is_left: bool,
}

/// What came of it; x to the right, y upwards.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    /// Centre and size of each box.
    pub(crate) boxes: Vec<(Point, f64, f64)>,
    pub(crate) spots: Vec<Spot>,
    /// Of each edge its corners, from its first end to its second.
    pub(crate) lines: Vec<Vec<Point>>,
}

/// A box or a point that a line passes.
#[derive(Clone, Debug)]
struct Node {
    layer: usize,
    /// None: a point of a line.
    part: Option<usize>,
    width: f64,
    height: f64,
    y: f64,
}

/// A piece of an edge between two neighbouring layers, or on one side of a box.
#[derive(Clone, Copy, Debug)]
struct Piece {
    edge: usize,
    from: usize,
    to: usize,
}

/// The layout of a graph.
pub(crate) fn layout(graph: &Graph) -> Layout {
    let count = graph.boxes.len();
    let mut is_connected = vec![false; count];
    for (a, b) in &graph.edges {
        is_connected[a.part] = true;
        is_connected[b.part] = true;
    }
    let forward = without_circles(graph);
    let layers = layers(graph, &forward, &is_connected);
    let mut work = Work::new(graph, forward, &layers, &is_connected);
    work.size();
    work.order();
    work.heights();
    let mut made = work.place();
    rows_below(graph, &is_connected, &mut made);
    made
}

/// For each edge whether it leads forward: turned where it would close a circle.
fn without_circles(graph: &Graph) -> Vec<bool> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done,
    }
    let count = graph.boxes.len();
    let mut out: Vec<Vec<(usize, usize)>> = vec![Vec::new(); count];
    let mut coming = vec![0_usize; count];
    for (k, (a, b)) in graph.edges.iter().enumerate() {
        if a.part != b.part {
            out[a.part].push((k, b.part));
            coming[b.part] += 1;
        }
    }
    let mut forward = vec![true; graph.edges.len()];
    let mut state = vec![State::New; count];
    // Those that nothing leads to come first, so that as few edges as possible are turned.
    let mut starts: Vec<usize> = (0..count).collect();
    starts.sort_by_key(|&own| coming[own] > 0);
    for start in starts {
        if state[start] != State::New {
            continue;
        }
        state[start] = State::Open;
        let mut stack = vec![(start, 0)];
        while let Some((own, next)) = stack.pop() {
            let Some(&(edge, to)) = out[own].get(next) else {
                state[own] = State::Done;
                continue;
            };
            stack.push((own, next + 1));
            match state[to] {
                State::Open => forward[edge] = false,
                State::Done => {}
                State::New => {
                    state[to] = State::Open;
                    stack.push((to, 0));
                }
            }
        }
    }
    forward
}

/// The layer of each box: behind all that lead to it, and no further before what it leads to than needed.
fn layers(graph: &Graph, forward: &[bool], is_connected: &[bool]) -> Vec<usize> {
    let count = graph.boxes.len();
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut coming = vec![0_usize; count];
    for (k, (a, b)) in graph.edges.iter().enumerate().filter(|(_, (a, b))| a.part != b.part) {
        let (from, to) = if forward[k] { (a.part, b.part) } else { (b.part, a.part) };
        after[from].push(to);
        coming[to] += 1;
    }
    let mut layer = vec![0_usize; count];
    let mut open: Vec<usize> = (0..count).filter(|&own| coming[own] == 0).collect();
    let mut order = Vec::new();
    let mut left = coming.clone();
    while let Some(own) = open.pop() {
        order.push(own);
        for &next in &after[own] {
            layer[next] = layer[next].max(layer[own] + 1);
            left[next] -= 1;
            if left[next] == 0 {
                open.push(next);
            }
        }
    }
    for &own in order.iter().rev().filter(|&&own| coming[own] == 0 && is_connected[own]) {
        if let Some(&nearest) = after[own].iter().min_by_key(|&&next| layer[next]) {
            layer[own] = layer[nearest].saturating_sub(1);
        }
    }
    layer
}

struct Work<'g> {
    graph: &'g Graph,
    forward: Vec<bool>,
    nodes: Vec<Node>,
    /// Of each box its node.
    node_of: BTreeMap<usize, usize>,
    /// Nodes of each layer from top to bottom.
    layers: Vec<Vec<usize>>,
    pieces: Vec<Piece>,
    /// Edges from a box to itself.
    own_loops: Vec<usize>,
    /// Ports on the left and on the right of each box, from top to bottom.
    sides: BTreeMap<(usize, bool), Vec<End>>,
}

impl<'g> Work<'g> {
    fn new(graph: &'g Graph, forward: Vec<bool>, layer: &[usize], is_connected: &[bool]) -> Self {
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
    fn ends(&self, edge: usize) -> (End, End) {
        let (a, b) = self.graph.edges[edge];
        if self.forward[edge] { (a, b) } else { (b, a) }
    }

    /// Ports of each side, and boxes as high as these need.
    fn size(&mut self) {
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
    fn order(&mut self) {
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
    fn heights(&mut self) {
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

    /// Height of a port, from the middle of its box.
    fn port_height(&self, end: End, is_left: bool) -> f64 {
        let Some(ends) = self.sides.get(&(end.part, is_left)) else { return 0.0 };
        let place = ends.iter().position(|own| *own == end).unwrap_or(0);
        let height = self.nodes[self.node_of[&end.part]].height;
        let step = height / ends.len() as f64;
        height / 2.0 - step * (place as f64 + 0.5)
    }

    /// Height at which a piece of an edge leaves or reaches a node.
    fn height_at(&self, node: usize, end: End, is_left: bool) -> f64 {
        let own = &self.nodes[node];
        own.y + if own.part.is_some() { self.port_height(end, is_left) } else { 0.0 }
    }

    /// Columns, tracks of the lines between them, and all corners.
    fn place(&self) -> Layout {
        let count = self.layers.len();
        let widths: Vec<f64> = self
            .layers
            .iter()
            .map(|layer| layer.iter().map(|&node| self.nodes[node].width).fold(0.0, f64::max))
            .collect();
        // Pieces by the channel that they run in, with heights of both ends; loops of a box stand in the channel behind it.
        let mut channels: Vec<Vec<(usize, End, f64, f64)>> = vec![Vec::new(); count];
        let mut loops: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for (k, piece) in self.pieces.iter().enumerate() {
            let (from, to) = self.ends(piece.edge);
            let heights = (self.height_at(piece.from, from, false), self.height_at(piece.to, to, true));
            channels[self.nodes[piece.from].layer].push((k, from, heights.0, heights.1));
        }
        for &edge in &self.own_loops {
            let (from, to) = self.ends(edge);
            let node = self.node_of[&from.part];
            let heights = (self.height_at(node, from, false), self.height_at(node, to, false));
            loops.insert(edge, heights);
            channels[self.nodes[node].layer].push((self.pieces.len() + edge, from, heights.0, heights.1));
        }
        let tracks: Vec<(BTreeMap<usize, usize>, usize)> = channels.iter().map(|channel| tracks(channel)).collect();
        let mut left = Vec::with_capacity(count);
        let mut x = 0.0;
        for (width, (_, many)) in widths.iter().zip(&tracks) {
            left.push(x);
            x += width + CHANNEL + TRACK * *many as f64;
        }
        let track_x = |layer: usize, piece: usize| {
            let track = tracks[layer].0.get(&piece).copied().unwrap_or(0);
            left[layer] + widths[layer] + CHANNEL / 2.0 + TRACK * track as f64
        };
        let middle = |layer: usize| left[layer] + widths[layer] / 2.0;
        let side = |node: usize, is_left: bool| {
            let own = &self.nodes[node];
            middle(own.layer) + if is_left { -own.width / 2.0 } else { own.width / 2.0 }
        };
        let mut made = Layout { lines: vec![Vec::new(); self.graph.edges.len()], ..Layout::default() };
        made.boxes = self.graph.boxes.iter().map(|&(width, height)| (Point::default(), width, height)).collect();
        for (&part, &node) in &self.node_of {
            let own = &self.nodes[node];
            made.boxes[part] = (Point::new(middle(own.layer), own.y), own.width, own.height);
        }
        for (&(part, is_left), ends) in &self.sides {
            let node = self.node_of[&part];
            let spots = ends.iter().map(|&end| {
                let y = self.nodes[node].y + self.port_height(end, is_left);
                Spot { end, at: Point::new(side(node, is_left), y), is_left }
            });
            made.spots.extend(spots);
        }
        for (k, piece) in self.pieces.iter().enumerate() {
            let (from, to) = self.ends(piece.edge);
            let (y1, y2) = (self.height_at(piece.from, from, false), self.height_at(piece.to, to, true));
            let x = track_x(self.nodes[piece.from].layer, k);
            let line = &mut made.lines[piece.edge];
            line.extend([
                Point::new(side(piece.from, false), y1),
                Point::new(x, y1),
                Point::new(x, y2),
                Point::new(side(piece.to, true), y2),
            ]);
        }
        for (&edge, &(y1, y2)) in &loops {
            let node = self.node_of[&self.graph.edges[edge].0.part];
            let (x0, x) = (side(node, false), track_x(self.nodes[node].layer, self.pieces.len() + edge));
            made.lines[edge] = [(x0, y1), (x, y1), (x, y2), (x0, y2)].map(|(x, y)| Point::new(x, y)).to_vec();
        }
        for (edge, line) in made.lines.iter_mut().enumerate() {
            straighten(line);
            if !self.forward[edge] {
                line.reverse();
            }
        }
        made
    }
}

/// A track for each piece of a channel that is not straight, so that only pieces from the same port lie on each other; and their number.
fn tracks(channel: &[(usize, End, f64, f64)]) -> (BTreeMap<usize, usize>, usize) {
    let mut bent: Vec<&(usize, End, f64, f64)> =
        channel.iter().filter(|(_, _, y1, y2)| (y1 - y2).abs() > 1e-9).collect();
    // Those that rise stand in front of those that fall when they begin higher, which saves crossings.
    bent.sort_by(|a, b| {
        let key = |own: &(usize, End, f64, f64)| if own.3 > own.2 { (0, -own.2) } else { (1, own.2) };
        let (one, other) = (key(a), key(b));
        one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
    });
    let mut taken: Vec<Vec<(End, f64, f64)>> = Vec::new();
    let mut track_of = BTreeMap::new();
    for &&(piece, from, y1, y2) in &bent {
        let (low, high) = (y1.min(y2) - 1.0, y1.max(y2) + 1.0);
        let is_free =
            |own: &Vec<(End, f64, f64)>| own.iter().all(|(other, l, h)| *other == from || *h < low || *l > high);
        let shares = |own: &Vec<(End, f64, f64)>| own.iter().any(|(other, _, _)| *other == from) && is_free(own);
        let track = taken.iter().position(shares).or_else(|| taken.iter().position(is_free)).unwrap_or_else(|| {
            taken.push(Vec::new());
            taken.len() - 1
        });
        taken[track].push((from, low, high));
        track_of.insert(piece, track);
    }
    (track_of, taken.len())
}

/// Leaves out corners that are none.
pub(crate) fn straighten(line: &mut Vec<Point>) {
    let is_same = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let mut kept: Vec<Point> = Vec::new();
    for &point in line.iter() {
        if kept.last().is_some_and(|last| is_same(last.x, point.x) && is_same(last.y, point.y)) {
            continue;
        }
        if let [.., a, b] = kept.as_slice()
            && ((is_same(a.x, b.x) && is_same(b.x, point.x)) || (is_same(a.y, b.y) && is_same(b.y, point.y)))
        {
            kept.pop();
        }
        kept.push(point);
    }
    *line = kept;
}

/// Boxes that nothing is connected to stand in rows below all others.
fn rows_below(graph: &Graph, is_connected: &[bool], made: &mut Layout) {
    let connected = || made.boxes.iter().zip(is_connected).filter(|(_, own)| **own).map(|(own, _)| own);
    let bottom = connected().map(|(at, _, height)| at.y - height / 2.0).fold(f64::INFINITY, f64::min);
    let left = connected().map(|(at, width, _)| at.x - width / 2.0).fold(f64::INFINITY, f64::min);
    let right = connected().map(|(at, width, _)| at.x + width / 2.0).fold(f64::NEG_INFINITY, f64::max);
    let (mut y, left, right) = match bottom.is_finite() {
        true => (bottom - 2.0 * APART, left, right.max(left + LEAST_WIDTH)),
        false => (0.0, 0.0, LEAST_WIDTH.max(graph.boxes.len() as f64 * 12.0)),
    };
    let (mut x, mut row) = (left, 0.0_f64);
    for (part, &(width, height)) in graph.boxes.iter().enumerate().filter(|(part, _)| !is_connected[*part]) {
        if x > left && x + width > right {
            (x, y, row) = (left, y - row - APART, 0.0);
        }
        made.boxes[part] = (Point::new(x + width / 2.0, y - height / 2.0), width, height);
        x += width + APART;
        row = row.max(height);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(part: usize, port: usize) -> End {
        End { part, port: Some(port) }
    }

    /// No box may lie on another, and lines run at right angles from port to port.
    fn verify(graph: &Graph, made: &Layout) {
        for (k, (a, w, h)) in made.boxes.iter().enumerate() {
            for (b, v, g) in &made.boxes[..k] {
                assert!((a.x - b.x).abs() >= (w + v) / 2.0 || (a.y - b.y).abs() >= (h + g) / 2.0 - 1e-9, "{made:?}");
            }
        }
        for (line, (a, b)) in made.lines.iter().zip(&graph.edges) {
            for pair in line.windows(2) {
                assert!(pair[0].x == pair[1].x || pair[0].y == pair[1].y, "{line:?}");
            }
            let is_spot = |end: &End, at: Point| made.spots.iter().any(|spot| spot.end == *end && spot.at == at);
            assert!(is_spot(a, line[0]) && is_spot(b, line[line.len() - 1]), "{line:?} {made:?}");
        }
    }

    #[test]
    fn a_chain_runs_from_left_to_right() {
        let edges = vec![(end(0, 0), end(1, 0)), (end(1, 1), end(2, 0)), (end(0, 0), end(2, 1))];
        let graph = Graph { boxes: vec![(40.0, 20.0); 4], edges };
        let made = layout(&graph);
        verify(&graph, &made);
        assert!(made.boxes[0].0.x < made.boxes[1].0.x && made.boxes[1].0.x < made.boxes[2].0.x);
        assert!(made.boxes[3].0.y < made.boxes[0].0.y, "what is not connected stands below");
    }

    #[test]
    fn circles_and_loops_of_a_box_are_drawn() {
        let edges =
            vec![(end(0, 0), end(1, 0)), (end(1, 1), end(0, 1)), (end(1, 2), end(1, 3)), (end(0, 0), end(2, 0))];
        let graph = Graph { boxes: vec![(40.0, 20.0); 3], edges };
        verify(&graph, &layout(&graph));
    }

    #[test]
    fn nothing_and_many_are_laid_out() {
        assert!(layout(&Graph::default()).boxes.is_empty());
        let edges = (0..120).map(|k: usize| (end(k * 7 % 40, k % 3), end(k * 11 % 40, 3 + k % 2))).collect();
        let graph = Graph { boxes: vec![(40.0, 20.0); 40], edges };
        verify(&graph, &layout(&graph));
    }

    #[test]
    fn heights_keep_their_distance_and_stay_near() {
        let graph = Graph {
            boxes: vec![(10.0, 10.0); 4],
            edges: vec![(end(0, 0), end(1, 0)), (end(0, 0), end(2, 0)), (end(0, 0), end(3, 0))],
        };
        let made = layout(&graph);
        let ys: Vec<f64> = made.boxes[1..].iter().map(|own| own.0.y).collect();
        let mean = ys.iter().sum::<f64>() / 3.0;
        assert!((mean - made.boxes[0].0.y).abs() < 1.0, "{ys:?} about {}", made.boxes[0].0.y);
    }
}
