//! A diagram as SVG.
//!
//! Parts and connections are groups that carry their number (`data-part`, `data-wire`), by which the script of the page finds them; the texts with
//! class `value` are empty and wait for values.  Icons of one look are drawn once and used again.  Texts are placed apart from their icons, so that
//! no icon mirrors or squeezes them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use hyd_doc::html::escape;

use super::arrange::{Arranged, PlacedPart, PlacedPort};
use super::geometry::{Affine, Extent, Point};
use super::graphic::{Align, BLACK, Color, Fill, Form, Graphic, Icon, Stroke};
use super::labels::{NARROW, labels};
use super::{Diagram, Part};

/// Pixels of a line of 1 mm, and of the thinnest one.
const PIXELS: f64 = 4.0;
const THINNEST: f64 = 0.75;
/// Height of letters in their line.
const LETTER: f64 = 0.85;
/// Units of a point of a font (1/72 inch in mm).
const POINT: f64 = 0.3528;
/// Heights of letters in a layered diagram, and by how much they are smaller in one that annotations place.
const NAME: f64 = 6.4;
const CLASS: f64 = 5.2;
const DRAWN: f64 = 0.62;

/// A picture, and its natural width in pixels.
pub(crate) struct Picture {
    pub(crate) svg: String,
    pub(crate) width: f64,
}

/// Pixels of a unit.
const LAYERED_SCALE: f64 = 2.0;
const DRAWN_SCALE: f64 = 3.2;

/// Draws a diagram; `states`: full names, those of parts are shown.
pub(crate) fn draw(diagram: &Diagram, arranged: &Arranged, states: &[String]) -> Picture {
    let mut pen = Pen::default();
    let mut body = String::new();
    if arranged.is_drawn {
        body.push_str("<g class=\"drawn\">");
        let background = Icon { extent: diagram.extent, graphics: diagram.graphics.clone() };
        pen.icon(&background, &Affine::IDENTITY, &mut body);
        body.push_str("</g>");
    }
    for (k, (wire, line)) in diagram.wires.iter().zip(&arranged.lines).enumerate() {
        let color = wire
            .color
            .filter(|_| arranged.is_drawn)
            .map_or_else(String::new, |color| format!(" stroke=\"{}\"", rgb(color)));
        let class = if arranged.is_drawn { "wire drawn" } else { "wire" };
        let _ = write!(
            body,
            "<g class=\"{class}\" data-wire=\"{k}\"><path d=\"{}\"{color}/><title>{} — {}</title></g>",
            path(line, false),
            escape(&wire.written[0]),
            escape(&wire.written[1])
        );
    }
    for (k, (part, place)) in diagram.parts.iter().zip(&arranged.parts).enumerate() {
        pen.part(k, part, place, arranged.is_drawn, &mut body);
    }
    let size = CLASS * if arranged.is_drawn { DRAWN } else { 1.0 };
    let mut bounds = arranged.bounds;
    for label in labels(diagram, arranged, states, (pen.texts, size)) {
        bounds = label.room.corners().into_iter().fold(bounds, |all, corner| all.around(corner));
        let (kind, k) = label.of;
        let _ = write!(
            body,
            "<text class=\"value\" data-{kind}=\"{k}\" data-states=\"{}\" x=\"{}\" y=\"{}\" font-size=\"{}\"></text>",
            label.states,
            short(label.at.x),
            short(-label.at.y),
            short(size)
        );
    }
    let scale = if arranged.is_drawn { DRAWN_SCALE } else { LAYERED_SCALE };
    let name = if diagram.path.is_empty() { &diagram.class } else { &diagram.path };
    let defs = std::mem::take(&mut pen.defs);
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"diagram\" viewBox=\"{} {} {} {}\" role=\"group\" aria-label=\"Diagram of {}\">\
         <defs>{defs}</defs>{body}</svg>",
        short(bounds.left()),
        short(-bounds.top()),
        short(bounds.width()),
        short(bounds.height()),
        escape(name)
    );
    Picture { svg, width: bounds.width() * scale }
}

/// A number with as many digits as a screen shows.
fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_string() } else { text.to_string() }
}

fn rgb([red, green, blue]: Color) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// The points of a line in the directions of SVG.
fn path(points: &[Point], closed: bool) -> String {
    let mut text = String::new();
    for (k, point) in points.iter().enumerate() {
        let _ = write!(text, "{}{} {}", if k == 0 { "M" } else { "L" }, short(point.x), short(-point.y));
    }
    if closed {
        text.push('Z');
    }
    text
}

/// A map from coordinates upwards to those of SVG.
fn matrix(map: &Affine) -> String {
    let number = |value: f64| {
        let text = format!("{value:.5}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_string() } else { text.to_string() }
    };
    let parts = [map.a, -map.b, map.c, -map.d, map.e, -map.f].map(number);
    format!("matrix({})", parts.join(" "))
}

/// What is drawn once and used again.
#[derive(Default)]
struct Pen {
    defs: String,
    looks: BTreeMap<String, usize>,
    paints: BTreeMap<String, String>,
    /// Boxes of texts, on which no value is written.
    texts: Vec<Extent>,
}

impl Pen {
    fn part(&mut self, k: usize, part: &Part, place: &PlacedPart, is_drawn: bool, out: &mut String) {
        let outline = &place.outline;
        // Who speaks what he sees must be understood: what is written in the part comes first.
        let class = part.class.rsplit('.').next().unwrap_or_default();
        let written = part.icon.graphics.iter().filter_map(|graphic| match &graphic.form {
            Form::Text { text, .. } => Some(text.trim()),
            _ => None,
        });
        let written: Vec<&str> = match (&place.icon, part.is_connector) {
            (Some(_), _) => written.filter(|text| !text.is_empty()).collect(),
            (None, true) => vec![&part.name],
            (None, false) => vec![&part.name, class],
        };
        let name = if written.contains(&part.name.as_str()) { "" } else { &part.name };
        let label = [written.join(" ").as_str(), name, &part.class, &part.description].map(str::to_string);
        let label: Vec<String> = label.into_iter().filter(|own| !own.is_empty()).collect();
        let kind = if part.is_connector { " connector" } else { "" };
        let _ = write!(
            out,
            "<g class=\"part{kind}\" data-part=\"{k}\" tabindex=\"0\" role=\"button\" aria-label=\"{}\">",
            escape(&label.join(", "))
        );
        let frame = if place.icon.is_some() { "hit" } else { "box" };
        let _ = write!(
            out,
            "<rect class=\"{frame}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{}\"/>",
            short(outline.left()),
            short(-outline.top()),
            short(outline.width()),
            short(outline.height()),
            short((outline.height() * 0.1).min(3.0))
        );
        match &place.icon {
            Some(map) => {
                out.push_str("<g class=\"drawn\">");
                self.icon(&part.icon, map, out);
                out.push_str("</g>");
            }
            None => plain_texts(part, outline, is_drawn, out),
        }
        for port in &place.ports {
            self.port(part, port, out);
        }
        out.push_str("</g>");
    }

    fn port(&mut self, part: &Part, place: &PlacedPort, out: &mut String) {
        let own = &part.ports[place.port];
        match &place.icon {
            Some(map) => {
                out.push_str("<g class=\"drawn\">");
                self.shapes(&own.icon, map, out);
                out.push_str("</g>");
            }
            None if own.is_hidden => {}
            None => {
                let class = if own.is_output { "port output" } else { "port" };
                let at = &place.at;
                let _ = write!(
                    out,
                    "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" data-name=\"{}\"/>",
                    short(at.left()),
                    short(-at.top()),
                    short(at.width()),
                    short(at.height()),
                    escape(&own.name)
                );
            }
        }
    }

    /// An icon with its texts.
    fn icon(&mut self, icon: &Icon, map: &Affine, out: &mut String) {
        self.shapes(icon, map, out);
        for graphic in &icon.graphics {
            if let Form::Text { .. } = graphic.form {
                self.texts.extend(letters(graphic, map, out));
            }
        }
    }

    /// What an icon has beside texts.
    fn shapes(&mut self, icon: &Icon, map: &Affine, out: &mut String) {
        let drawn: String = icon.graphics.iter().map(|graphic| self.shape(graphic)).collect();
        if drawn.is_empty() {
            return;
        }
        let next = self.looks.len();
        let id = *self.looks.entry(drawn.clone()).or_insert(next);
        if id == next {
            let _ = write!(self.defs, "<g id=\"look-{id}\">{drawn}</g>");
        }
        let _ = write!(out, "<use href=\"#look-{id}\" transform=\"{}\"/>", matrix(map));
    }

    /// A graphic but for texts, in coordinates upwards: the map turns them over.
    fn shape(&mut self, graphic: &Graphic) -> String {
        let up = |points: &[Point], smooth: bool, closed: bool| {
            if smooth {
                bezier(points, closed)
            } else {
                path(&points.iter().map(|own| Point::new(own.x, -own.y)).collect::<Vec<_>>(), closed)
            }
        };
        let body = match &graphic.form {
            Form::Line { points, smooth, arrows } => {
                let line = format!("<path d=\"{}\" fill=\"none\"{}/>", up(points, *smooth, false), stroke(graphic));
                line + &heads(points, *arrows, graphic)
            }
            Form::Polygon { points, smooth } => {
                format!("<path d=\"{}\"{}{}/>", up(points, *smooth, true), self.paint(graphic), stroke(graphic))
            }
            Form::Rectangle { extent, radius } => format!(
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{}\"{}{}/>",
                short(extent.left()),
                short(extent.bottom()),
                short(extent.width()),
                short(extent.height()),
                short(*radius),
                self.paint(graphic),
                stroke(graphic)
            ),
            Form::Ellipse { extent, angles, pie } => self.ellipse(extent, *angles, *pie, graphic),
            Form::Text { .. } => return String::new(),
            Form::Picture { extent, data } => {
                let kind = if data.starts_with("/9j/") {
                    "jpeg"
                } else if data.starts_with("R0lG") {
                    "gif"
                } else {
                    "png"
                };
                format!(
                    "<image href=\"data:image/{kind};base64,{data}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" transform=\"matrix(1 0 0 -1 0 {})\"/>",
                    short(extent.left()),
                    short(extent.bottom()),
                    short(extent.width()),
                    short(extent.height()),
                    short(extent.bottom() + extent.top())
                )
            }
        };
        if graphic.origin == Point::default() && graphic.rotation == 0.0 {
            return body;
        }
        let (at, turn) = (graphic.origin, short(graphic.rotation));
        format!("<g transform=\"translate({} {}) rotate({turn})\">{body}</g>", short(at.x), short(at.y))
    }

    fn ellipse(&mut self, extent: &Extent, (start, end): (f64, f64), pie: bool, graphic: &Graphic) -> String {
        let (at, rx, ry) = (extent.center(), extent.width() / 2.0, extent.height() / 2.0);
        if (end - start).abs() >= 360.0 {
            return format!(
                "<ellipse cx=\"{}\" cy=\"{}\" rx=\"{}\" ry=\"{}\"{}{}/>",
                short(at.x),
                short(at.y),
                short(rx),
                short(ry),
                self.paint(graphic),
                stroke(graphic)
            );
        }
        let on = |degrees: f64| {
            let (sin, cos) = hyd_system::math::sin_cos(degrees.to_radians());
            format!("{} {}", short(at.x + rx * cos), short(at.y + ry * sin))
        };
        let large = u8::from((end - start).abs() > 180.0);
        let sweep = u8::from(end > start);
        let arc = format!("A{} {} 0 {large} {sweep} {}", short(rx), short(ry), on(end));
        let is_filled = graphic.fill != Fill::None;
        let way = match pie && is_filled {
            true => format!("M{} {}L{}{arc}Z", short(at.x), short(at.y), on(start)),
            false => format!("M{}{arc}", on(start)),
        };
        format!("<path d=\"{way}\"{}{}/>", self.paint(graphic), stroke(graphic))
    }

    /// How an area is filled.
    fn paint(&mut self, graphic: &Graphic) -> String {
        let (line, fill) = (rgb(graphic.color), rgb(graphic.fill_color));
        match graphic.fill {
            Fill::None => return " fill=\"none\"".to_string(),
            Fill::Solid => return format!(" fill=\"{fill}\""),
            _ => {}
        }
        let key = format!("{:?}-{line}-{fill}", graphic.fill);
        let next = self.paints.len();
        if let Some(id) = self.paints.get(&key) {
            return format!(" fill=\"url(#{id})\"");
        }
        let id = format!("paint-{next}");
        let stops = |colors: &[(&str, &str)]| -> String {
            colors.iter().map(|(at, color)| format!("<stop offset=\"{at}\" stop-color=\"{color}\"/>")).collect()
        };
        let through = stops(&[("0", &line), ("0.5", &fill), ("1", &line)]);
        let lines = |ways: &str| {
            format!(
                "<pattern id=\"{id}\" width=\"10\" height=\"10\" patternUnits=\"userSpaceOnUse\"><rect width=\"10\" height=\"10\" fill=\"{fill}\"/>\
                 <path d=\"{ways}\" stroke=\"{line}\" stroke-width=\"0.8\"/></pattern>"
            )
        };
        let made = match graphic.fill {
            Fill::HorizontalCylinder => {
                format!("<linearGradient id=\"{id}\" x2=\"0\" y2=\"1\">{through}</linearGradient>")
            }
            Fill::VerticalCylinder => format!("<linearGradient id=\"{id}\">{through}</linearGradient>"),
            Fill::Sphere => {
                format!("<radialGradient id=\"{id}\">{}</radialGradient>", stops(&[("0", &fill), ("1", &line)]))
            }
            Fill::Horizontal => lines("M0 5H10"),
            Fill::Vertical => lines("M5 0V10"),
            Fill::Cross => lines("M0 5H10M5 0V10"),
            Fill::Forward => lines("M0 0L10 10"),
            Fill::Backward => lines("M0 10L10 0"),
            _ => lines("M0 0L10 10M0 10L10 0"),
        };
        self.defs.push_str(&made);
        self.paints.insert(key, id.clone());
        format!(" fill=\"url(#{id})\"")
    }
}

/// Name and class in a plain box.
fn plain_texts(part: &Part, outline: &Extent, is_drawn: bool, out: &mut String) {
    let at = outline.center();
    let class = part.class.rsplit('.').next().unwrap_or_default();
    // A box that annotations place may be too small for its texts.
    let fit = |text: &str, wanted: f64| {
        let wanted = if is_drawn { wanted * DRAWN } else { wanted };
        let widest = outline.width() / (text.chars().count().max(1) as f64 * NARROW);
        wanted.min(widest.max(1.5))
    };
    let mut line = |class: &str, text: &str, y: f64, size: f64| {
        let _ = write!(
            out,
            "<text class=\"{class}\" x=\"{}\" y=\"{}\" font-size=\"{}\">{}</text> ",
            short(at.x),
            short(-y),
            short(size),
            escape(text)
        );
    };
    let name = fit(&part.name, NAME);
    if part.is_connector {
        line("name", &part.name, at.y - name * 0.34, name);
    } else {
        line("name", &part.name, at.y + name * 0.15, name);
        let size = fit(class, CLASS);
        line("class", class, at.y - size * 1.25, size);
    }
}

fn stroke(graphic: &Graphic) -> String {
    let dash = match graphic.dash {
        Stroke::None => return " stroke=\"none\"".to_string(),
        Stroke::Solid => "",
        Stroke::Dash => " stroke-dasharray=\"8 4\"",
        Stroke::Dot => " stroke-dasharray=\"2 3\"",
        Stroke::DashDot => " stroke-dasharray=\"8 3 2 3\"",
        Stroke::DashDotDot => " stroke-dasharray=\"8 3 2 3 2 3\"",
    };
    let width = (graphic.thickness * PIXELS).max(THINNEST);
    format!(
        " stroke=\"{}\" stroke-width=\"{}\"{dash} vector-effect=\"non-scaling-stroke\"",
        rgb(graphic.color),
        short(width)
    )
}

/// A smooth line: straight to the middle of the first piece, then curves from middle to middle (Modelica 3.6, section 18.6.1.3).
fn bezier(points: &[Point], closed: bool) -> String {
    let up = |point: Point| format!("{} {}", short(point.x), short(point.y));
    let middle = |a: Point, b: Point| Extent { from: a, to: b }.center();
    let [first, .., last] = points else { return String::new() };
    if points.len() < 3 {
        return format!("M{}L{}", up(*first), up(*last));
    }
    let mut text = format!("M{}L{}", up(*first), up(middle(points[0], points[1])));
    for triple in points.windows(3) {
        let _ = write!(text, "Q{} {}", up(triple[1]), up(middle(triple[1], triple[2])));
    }
    let _ = write!(text, "L{}", up(*last));
    if closed {
        text.push('Z');
    }
    text
}

/// Heads of arrows.
fn heads(points: &[Point], arrows: [bool; 2], graphic: &Graphic) -> String {
    const LENGTH: f64 = 8.0;
    const HALF_WIDTH: f64 = 3.0;
    let head = |tip: Point, from: Point| {
        let (dx, dy) = (tip.x - from.x, tip.y - from.y);
        let length = (dx * dx + dy * dy).sqrt();
        if length == 0.0 {
            return String::new();
        }
        let (dx, dy) = (dx / length, dy / length);
        let base = Point::new(tip.x - LENGTH * dx, tip.y - LENGTH * dy);
        let corner = |side: f64| {
            format!("{} {}", short(base.x - side * HALF_WIDTH * dy), short(base.y + side * HALF_WIDTH * dx))
        };
        format!(
            "<path d=\"M{} {}L{}L{}Z\" fill=\"{}\"/>",
            short(tip.x),
            short(tip.y),
            corner(1.0),
            corner(-1.0),
            rgb(graphic.color)
        )
    };
    let count = points.len();
    let first = if arrows[0] { head(points[0], points[1]) } else { String::new() };
    let last = if arrows[1] { head(points[count - 1], points[count - 2]) } else { String::new() };
    first + &last
}

/// A text of an icon, upright whatever the icon's turn; gives its box.
fn letters(graphic: &Graphic, map: &Affine, out: &mut String) -> Option<Extent> {
    let Form::Text { extent, text, size, align, bold, italic } = &graphic.form else { return None };
    let text = text.trim();
    if text.is_empty() {
        return None;
    }
    let map = map.after(&Affine::placed(graphic.origin, graphic.rotation));
    let (sx, sy) = map.scales();
    let (width, height) = (extent.width() * sx, extent.height() * sy);
    let lines: Vec<&str> = text.lines().collect();
    let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or(1).max(1);
    let wanted = match *size > 0.0 {
        // Points are mm of paper, and a unit is a mm.
        true => size * POINT,
        false => {
            let fit = height / lines.len() as f64 * LETTER;
            if width > 0.0 { fit.min(width / (longest as f64 * NARROW)) } else { fit }
        }
    };
    if wanted <= 0.05 {
        return None;
    }
    // The direction of its line, turned so that nobody has to stand on his head.
    let mut angle = hyd_system::math::Function::Atan2.apply(map.b, map.a).to_degrees();
    let mut flipped = false;
    if angle > 90.0 + 1e-6 || angle <= -90.0 + 1e-6 {
        angle += if angle > 0.0 { -180.0 } else { 180.0 };
        flipped = true;
    }
    let side = match (align, flipped) {
        (Align::Left, false) | (Align::Right, true) => -1.0,
        (Align::Right, false) | (Align::Left, true) => 1.0,
        (Align::Center, _) => 0.0,
    };
    let own = extent.center();
    let along = if flipped { -side } else { side };
    let at = map.apply(Point::new(own.x + along * extent.width() / 2.0, own.y));
    let anchor = ["start", "middle", "end"][(side + 1.0) as usize];
    let style = format!(
        "{}{}",
        if *bold { " font-weight=\"bold\"" } else { "" },
        if *italic { " font-style=\"italic\"" } else { "" }
    );
    let color = if graphic.color == BLACK { "currentColor".to_string() } else { rgb(graphic.color) };
    let turn = if angle.abs() < 0.01 {
        String::new()
    } else {
        format!(" transform=\"rotate({} {} {})\"", short(-angle), short(at.x), short(-at.y))
    };
    let top = -at.y + wanted * 0.35 - wanted * 1.15 * (lines.len() as f64 - 1.0) / 2.0;
    for (k, line) in lines.iter().enumerate() {
        let _ = write!(
            out,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{anchor}\" fill=\"{color}\"{style}{turn}>{}</text> ",
            short(at.x),
            short(top + wanted * 1.15 * k as f64),
            short(wanted),
            escape(line)
        );
    }
    let half = wanted * NARROW * longest as f64 / 2.0;
    let middle = at.x - side * half;
    Some(Extent::new(middle - half, at.y - wanted / 2.0, middle + half, at.y + wanted / 2.0))
}
