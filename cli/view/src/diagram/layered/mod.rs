//! A layered layout of boxes with ports: parts from left to right along their connections, lines at right angles.
//!
//! After K. Sugiyama, S. Tagawa, M. Toda, "Methods for visual understanding of hierarchical system structures" (1981): circles are cut, each box gets
//! a layer by the longest way to it, lines over several layers get a point in each, the order within layers follows the neighbours' (their mean),
//! and heights the same under the least distances, which are kept by pooling (R. E. Barlow and others, 1972).  A connector that is connected to
//! both sides is drawn on both.

mod graph;
mod layers;
mod order;
mod routes;

use super::geometry::Point;
pub(crate) use graph::{Graph, Layout};
use layers::{layers, without_circles};
use order::{APART, Work};
pub(crate) use routes::straighten;

/// Width that boxes without connections fill before a new row begins.
const LEAST_WIDTH: f64 = 260.0;

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
    use crate::diagram::End;

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
