//! Where boxes, ports and lines are drawn once layers, order and heights are known: columns, and between them a track for each line.

use std::collections::BTreeMap;

use super::graph::{Layout, Spot};
use super::order::Work;
use crate::diagram::End;
use crate::diagram::geometry::Point;

/// Width of a channel between layers without lines, and of each line in it.
const CHANNEL: f64 = 22.0;
const TRACK: f64 = 5.0;

impl Work<'_> {
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
    pub(super) fn place(&self) -> Layout {
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
