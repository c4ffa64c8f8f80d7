//! Where everything in a diagram is drawn: as annotations place it, else by the layered layout.

use super::detour::{Drawn, detour};
use super::geometry::{Affine, Extent, Point};
use super::graphic::{Form, Icon, Placement};
use super::labels::nets;
use super::layered::{Graph, Layout, layout, straighten};
use super::{Diagram, End, Part};

/// Widths of a character of a name and of a class, and what is left free around them, in units of a layered diagram.
const NAME_CHARACTER: f64 = 3.9;
const CLASS_CHARACTER: f64 = 3.0;
const MARGIN: f64 = 12.0;
const LEAST_BOX: (f64, f64) = (44.0, 28.0);
/// Height of a connector that the diagram's own model has.
const CONNECTOR: f64 = 14.0;
/// Side of an icon that no annotation places.
const ICON: f64 = 44.0;
/// Half the side of a port of a plain box.
pub(crate) const PORT: f64 = 1.6;
/// Least room around a diagram; below a part its values are written.
const ROOM: f64 = 16.0;
/// Distance of parts that are not placed where others are.
const APART: f64 = 10.0;
/// Lines of a diagram that are led around parts.
const MOST_SEARCHED: usize = 300;

/// A diagram with places.
#[derive(Debug)]
pub(crate) struct Arranged {
    pub(crate) bounds: Extent,
    pub(crate) parts: Vec<PlacedPart>,
    /// Corners of each connection.
    pub(crate) lines: Vec<Vec<Point>>,
    /// By annotations.
    pub(crate) is_drawn: bool,
}

/// A part with its place.
#[derive(Debug)]
pub(crate) struct PlacedPart {
    pub(crate) outline: Extent,
    /// From the coordinates of its icon; none: a plain box.
    pub(crate) icon: Option<Affine>,
    pub(crate) ports: Vec<PlacedPort>,
}

/// A connector of a part with its place.
#[derive(Debug)]
pub(crate) struct PlacedPort {
    pub(crate) port: usize,
    pub(crate) at: Extent,
    pub(crate) icon: Option<Affine>,
}

/// Places everything.
pub(crate) fn arrange(diagram: &Diagram) -> Arranged {
    let mut made = match diagram.parts.iter().any(|part| part.placement.is_some()) {
        true => drawn(diagram),
        false => layered(diagram),
    };
    let outlines = made.parts.iter().flat_map(|part| part.outline.corners());
    let ports = made.parts.iter().flat_map(|part| part.ports.iter().flat_map(|port| port.at.corners()));
    let points = outlines.chain(ports).chain(made.lines.iter().flatten().copied());
    let graphics = diagram.graphics.iter().flat_map(|own| {
        match &own.form {
            Form::Line { points, .. } | Form::Polygon { points, .. } => points.clone(),
            Form::Rectangle { extent, .. }
            | Form::Ellipse { extent, .. }
            | Form::Text { extent, .. }
            | Form::Picture { extent, .. } => extent.corners().to_vec(),
        }
        .into_iter()
        .map(|point| Affine::placed(own.origin, own.rotation).apply(point))
    });
    let mut all = points.chain(graphics.collect::<Vec<_>>());
    let first = all.next().unwrap_or_default();
    let around = all.fold(Extent { from: first, to: first }, |around, point| around.around(point));
    let room = if made.is_drawn { ROOM / 2.0 } else { ROOM };
    made.bounds = Extent::new(around.left() - room, around.bottom() - room, around.right() + room, around.top() + room);
    made
}

fn has_icon(icon: &Icon) -> bool {
    !icon.graphics.is_empty()
}

/// The box that a part needs where it is drawn plainly.
fn plain_size(part: &Part) -> (f64, f64) {
    let class = part.class.rsplit('.').next().unwrap_or_default();
    let length = |text: &str, character: f64| text.chars().count() as f64 * character + MARGIN;
    if part.is_connector {
        return (length(&part.name, NAME_CHARACTER).max(LEAST_BOX.0 / 2.0), CONNECTOR);
    }
    if has_icon(&part.icon) {
        return (ICON, ICON);
    }
    (length(&part.name, NAME_CHARACTER).max(length(class, CLASS_CHARACTER)).max(LEAST_BOX.0), LEAST_BOX.1)
}

fn layered(diagram: &Diagram) -> Arranged {
    let boxes = diagram.parts.iter().map(plain_size).collect();
    let edges = diagram.wires.iter().map(|wire| (wire.from, wire.to)).collect();
    let Layout { boxes, spots, lines } = layout(&Graph { boxes, edges });
    let parts = diagram.parts.iter().zip(boxes).enumerate().map(|(k, (part, (at, width, height)))| {
        let outline = Extent::new(at.x - width / 2.0, at.y - height / 2.0, at.x + width / 2.0, at.y + height / 2.0);
        let own = spots.iter().filter(|spot| spot.end.part == k);
        let ports =
            own.filter_map(|spot| Some(PlacedPort { port: spot.end.port?, at: square(spot.at, PORT), icon: None }));
        let icon = has_icon(&part.icon).then(|| Affine::onto(part.icon.extent, outline));
        PlacedPart { outline, icon: icon.filter(|_| !part.is_connector), ports: ports.collect() }
    });
    let parts = parts.collect();
    Arranged { bounds: Extent::new(0.0, 0.0, 0.0, 0.0), parts, lines, is_drawn: false }
}

fn square(at: Point, half: f64) -> Extent {
    Extent::new(at.x - half, at.y - half, at.x + half, at.y + half)
}

/// The map from an icon's coordinates to where the icon is placed.
fn placed(placement: &Placement, icon: &Icon) -> Affine {
    Affine::placed(placement.origin, placement.rotation).after(&Affine::onto(icon.extent, placement.extent))
}

fn drawn(diagram: &Diagram) -> Arranged {
    let placed_parts = diagram.parts.iter().filter_map(|part| {
        let placement = part.placement?;
        Some(placed(&placement, &part.icon).bounds(&part.icon.extent))
    });
    let placed_parts: Vec<Extent> = placed_parts.collect();
    let bottom = placed_parts.iter().map(Extent::bottom).fold(f64::INFINITY, f64::min);
    let left = placed_parts.iter().map(Extent::left).fold(f64::INFINITY, f64::min);
    let right = placed_parts.iter().map(Extent::right).fold(f64::NEG_INFINITY, f64::max).max(left + 10.0 * APART);
    let (mut x, mut y, mut row) = (left, bottom - APART, 0.0_f64);
    let mut parts = Vec::new();
    for part in &diagram.parts {
        let map = match part.placement {
            Some(placement) => placed(&placement, &part.icon),
            None => {
                // What others have not placed stands below them, half as large as alone.
                let (width, height) = plain_size(part);
                let (width, height) = (width / 2.0, height / 2.0);
                if x > left && x + width > right {
                    (x, y, row) = (left, y - row - APART, 0.0);
                }
                let outline = Extent::new(x, y - height, x + width, y);
                x += width + APART;
                row = row.max(height);
                Affine::onto(part.icon.extent, outline)
            }
        };
        let outline = map.bounds(&part.icon.extent);
        let ports = ports(part, &map, &outline);
        parts.push(PlacedPart { outline, icon: has_icon(&part.icon).then_some(map), ports });
    }
    let place = |end: End| {
        let own = &parts[end.part];
        let port = end.port.and_then(|port| own.ports.iter().find(|own| own.port == port));
        port.map_or_else(|| own.outline.center(), |port| port.at.center())
    };
    let ends: Vec<(Point, Point)> = diagram.wires.iter().map(|wire| (place(wire.from), place(wire.to))).collect();
    let outlines: Vec<Extent> = parts.iter().map(|part| part.outline).collect();
    let lines = lines(diagram, &outlines, &ends);
    Arranged { bounds: Extent::new(0.0, 0.0, 0.0, 0.0), parts, lines, is_drawn: true }
}

/// Ports of a part that annotations place; those that none places stand on the sides, in turn.
fn ports(part: &Part, map: &Affine, outline: &Extent) -> Vec<PlacedPort> {
    let open = part.ports.iter().filter(|port| port.placement.is_none()).count();
    let step = outline.height() / (open.div_ceil(2).max(1) + 1) as f64;
    let mut next = 0;
    let mut made = Vec::new();
    for (k, port) in part.ports.iter().enumerate() {
        match port.placement {
            Some(placement) => {
                let map = map.after(&placed(&placement, &port.icon));
                let icon = (has_icon(&port.icon) && !port.is_hidden).then_some(map);
                made.push(PlacedPort { port: k, at: map.bounds(&port.icon.extent), icon });
            }
            None => {
                let x = if next % 2 == 0 { outline.left() } else { outline.right() };
                let y = outline.top() - step * (next / 2 + 1) as f64;
                next += 1;
                made.push(PlacedPort { port: k, at: square(Point::new(x, y), PORT / 2.0), icon: None });
            }
        }
    }
    made
}

/// The line of each connection: as its annotation says, else around the parts and beside the lines before it.
fn lines(diagram: &Diagram, outlines: &[Extent], ends: &[(Point, Point)]) -> Vec<Vec<Point>> {
    let mut net_of = vec![0; diagram.wires.len()];
    for (net, wires) in nets(diagram).into_iter().enumerate() {
        wires.into_iter().for_each(|wire| net_of[wire] = net);
    }
    let pieces = |net: usize, line: &[Point]| -> Vec<Drawn> {
        line.windows(2).map(|pair| Drawn { net, from: pair[0], to: pair[1] }).collect()
    };
    let annotated = diagram.wires.iter().zip(&net_of).filter_map(|(wire, &net)| Some((net, wire.points.as_ref()?)));
    let mut drawn: Vec<Drawn> = annotated.flat_map(|(net, line)| pieces(net, line)).collect();
    let mut made = Vec::new();
    let mut searched = 0;
    for (k, (wire, &(from, to))) in diagram.wires.iter().zip(ends).enumerate() {
        let line = wire.points.clone().unwrap_or_else(|| {
            searched += 1;
            let found = (searched <= MOST_SEARCHED).then(|| detour(outlines, &drawn, net_of[k], (from, to)));
            let line = found.flatten().unwrap_or_else(|| angled(from, to));
            drawn.extend(pieces(net_of[k], &line));
            line
        });
        made.push(line);
    }
    made
}

/// A line at right angles.
fn angled(from: Point, to: Point) -> Vec<Point> {
    let middle = (from.x + to.x) / 2.0;
    let mut line = vec![from, Point::new(middle, from.y), Point::new(middle, to.y), to];
    straighten(&mut line);
    line
}
