//! Where values are written: one for each set of connectors that are connected, one for each part with states, none on another text.

use std::collections::BTreeMap;

use super::arrange::Arranged;
use super::geometry::{Extent, Point};
use super::{Diagram, End};

/// Width of a letter by its height.
pub(crate) const NARROW: f64 = 0.56;
/// Letters of a value with its unit, and of what stands beside it for a state.
const VALUE: f64 = 12.5;
const BESIDE: f64 = 3.0;
/// States of a part that are written.
const MOST_STATES: usize = 2;

/// A place for a value.
#[derive(Debug, PartialEq)]
pub(crate) struct Label {
    /// `wire` or `part`, and its number.
    pub(crate) of: (&'static str, usize),
    /// The middle of its line of writing.
    pub(crate) at: Point,
    /// States of a part that have room.
    pub(crate) states: usize,
    /// The box of what is written there.
    pub(crate) room: Extent,
}

/// The places; `texts`: boxes that are taken, and the height of letters.
pub(crate) fn labels(
    diagram: &Diagram,
    arranged: &Arranged,
    states: &[String],
    (mut taken, size): (Vec<Extent>, f64),
) -> Vec<Label> {
    let mut made = Vec::new();
    let outlines: Vec<Extent> = arranged.parts.iter().map(|part| part.outline).collect();
    let is_free = |own: &Extent, taken: &[Extent]| taken.iter().all(|other| !overlap(own, other));
    for (k, part) in diagram.parts.iter().enumerate().filter(|(_, part)| !part.is_connector) {
        let own = states.iter().filter_map(|state| state.strip_prefix(&part.path)?.strip_prefix('.'));
        let names: Vec<&str> = own.filter(|name| !name.contains('.')).take(MOST_STATES).collect();
        if names.is_empty() {
            continue;
        }
        let outline = outlines[k];
        let below = |lines: f64| Point::new(outline.center().x, outline.bottom() - size * (0.2 + lines));
        let above = Point::new(outline.center().x, outline.top() + size * 0.4);
        let places = [below(1.0), below(2.1), above, below(3.2)];
        // Rather one state than none.
        let found = (1..=names.len()).rev().find_map(|count| {
            let letters: f64 = names[..count].iter().map(|name| name.chars().count() as f64 + BESIDE + VALUE).sum();
            let at = places.into_iter().find(|at| is_free(&around(*at, letters, size), &taken))?;
            Some((at, letters, count))
        });
        if let Some((at, letters, states)) = found {
            let room = around(at, letters, size);
            taken.push(room);
            made.push(Label { of: ("part", k), at, states, room });
        }
    }
    taken.extend(outlines);
    for wires in nets(diagram) {
        let lines = wires.iter().filter(|&&wire| !diagram.wires[wire].values.is_empty());
        let pieces = lines.flat_map(|&wire| arranged.lines[wire].windows(2).map(move |pair| (wire, pair[0], pair[1])));
        let mut pieces: Vec<(usize, Point, Point)> = pieces.collect();
        // A value is read along a line that lies.
        let length = |a: Point, b: Point| (b.x - a.x).abs() + 0.4 * (b.y - a.y).abs();
        pieces.sort_by(|one, other| length(other.1, other.2).total_cmp(&length(one.1, one.2)));
        let found = pieces.into_iter().find_map(|(wire, a, b)| {
            let middle = Extent { from: a, to: b }.center();
            let places = [0.3, -1.0].map(|lines| Point::new(middle.x, middle.y + size * lines));
            let at = places.into_iter().find(|at| is_free(&around(*at, VALUE, size), &taken))?;
            Some(Label { of: ("wire", wire), at, states: 0, room: around(at, VALUE, size) })
        });
        if let Some(label) = found {
            taken.push(label.room);
            made.push(label);
        }
    }
    made
}

/// The box of so many letters about a point of their line.
fn around(at: Point, letters: f64, size: f64) -> Extent {
    let half = letters * size * NARROW / 2.0;
    Extent::new(at.x - half, at.y - 0.2 * size, at.x + half, at.y + 0.8 * size)
}

fn overlap(a: &Extent, b: &Extent) -> bool {
    a.left() < b.right() && b.left() < a.right() && a.bottom() < b.top() && b.bottom() < a.top()
}

/// Connections by the sets of connectors that they join.
pub(crate) fn nets(diagram: &Diagram) -> Vec<Vec<usize>> {
    let mut of_end: BTreeMap<End, usize> = BTreeMap::new();
    let mut nets: Vec<Vec<usize>> = Vec::new();
    for (k, wire) in diagram.wires.iter().enumerate() {
        let known: Vec<usize> = [wire.from, wire.to].iter().filter_map(|end| of_end.get(end).copied()).collect();
        let own = match known.as_slice() {
            [] => {
                nets.push(Vec::new());
                nets.len() - 1
            }
            [first, ..] => *first,
        };
        for other in known.into_iter().filter(|&other| other != own) {
            let joined = std::mem::take(&mut nets[other]);
            nets[own].extend(joined);
            of_end.values_mut().filter(|net| **net == other).for_each(|net| *net = own);
        }
        nets[own].push(k);
        of_end.insert(wire.from, own);
        of_end.insert(wire.to, own);
    }
    nets.retain(|net| !net.is_empty());
    nets
}

#[cfg(test)]
mod tests {
    use super::super::Wire;
    use super::super::graphic::default_extent;
    use super::*;

    #[test]
    fn what_is_connected_is_one_net() {
        let end = |part: usize| End { part, port: Some(0) };
        let wire = |from: usize, to: usize| Wire {
            from: end(from),
            to: end(to),
            written: Default::default(),
            points: None,
            color: None,
            values: Vec::new(),
        };
        let diagram = Diagram {
            path: String::new(),
            class: String::new(),
            parts: Vec::new(),
            wires: vec![wire(0, 1), wire(2, 3), wire(4, 5), wire(1, 2)],
            extent: default_extent(),
            graphics: Vec::new(),
        };
        let mut found = nets(&diagram);
        found.iter_mut().for_each(|net| net.sort_unstable());
        assert_eq!(found, [vec![0, 1, 3], vec![2]]);
    }
}
