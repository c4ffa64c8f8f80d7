//! Where everything stands: margins, axes, ticks, legends, curves.
//!
//! All panels share the left edge and the time axis.  Each is, from top to bottom, a legend (if it shows several
//! variables) and the axes; the lowest carries the times.  Value axes hold all finite values with a small margin.

use crate::drawing::{Anchor, Drawing, Shape};
use crate::figure::{Figure, Panel};
use crate::font::{fit_text, text_width};
use crate::simplify::simplify;
use crate::style::{Coding, FRAME, GRID, TEXT, TEXT_SIZE, TITLE_SIZE, curve_stroke, run_stroke};
use crate::ticks::{Ticks, ticks};
use crate::units::{Scale, scale};

/// Space between shapes that belong together.
const GAP: f64 = 6.0;
/// Height of a line of a legend.
const LINE: f64 = 17.0;
const TICK: f64 = 4.0;
/// Length of the sample of a line in a legend.
const SAMPLE: f64 = 26.0;
/// Ranges smaller than this part of the values are rounding noise and drawn as a constant.
const SMALLEST_RANGE: f64 = 1e-5;

/// Members of a family that its legend names.
const FAMILY_NAMES: usize = 5;

/// A range of values, and how it is shown.
struct Axis {
    low: f64,
    high: f64,
    scale: Scale,
    ticks: Ticks,
}

impl Axis {
    fn new(low: f64, high: f64, margin: f64, unit: &str, intervals: usize) -> Self {
        let scale = scale(unit, low.abs().max(high.abs()));
        let (mut low, mut high) = (low * scale.factor, high * scale.factor);
        let least = SMALLEST_RANGE * low.abs().max(high.abs());
        if high - low <= least {
            let half = if low == 0.0 && high == 0.0 { 1.0 } else { 0.05 * low.abs().max(high.abs()) };
            (low, high) = (low - half, high + half);
        } else {
            let space = margin * (high - low);
            (low, high) = (low - space, high + space);
        }
        Self { low, high, scale, ticks: ticks(low, high, intervals) }
    }

    /// Position of a value between `from` (low end) and `to` (high end).
    fn place(&self, value: f64, from: f64, to: f64) -> f64 {
        self.place_scaled(value * self.scale.factor, from, to)
    }

    fn place_scaled(&self, value: f64, from: f64, to: f64) -> f64 {
        from + (value - self.low) / (self.high - self.low) * (to - from)
    }
}

/// The rectangle of a panel's axes.
#[derive(Clone, Copy)]
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

pub(crate) fn lay_out(figure: &Figure) -> Drawing {
    let height = figure.panel_height.unwrap_or(match figure.panels.len() {
        0 | 1 => 300.0,
        2 => 200.0,
        3 => 160.0,
        _ => 130.0,
    });
    let time = time_axis(figure);
    let axes: Vec<Axis> = figure.panels.iter().map(|panel| value_axis(panel, height)).collect();
    let ruler = axes.iter().flat_map(|axis| &axis.ticks.labels).map(|label| text_width(label, TEXT_SIZE));
    let left = TEXT_SIZE + 3.0 * GAP + ruler.fold(0.0, f64::max) + TICK;
    let right = (figure.width - 3.0 * GAP).max(left + 40.0);
    let coding = coding(figure);

    let mut drawing = Drawing { width: figure.width, height: 0.0, shapes: Vec::new() };
    let shapes = &mut drawing.shapes;
    let mut y = 2.0 * GAP;
    if let Some(title) = &figure.title {
        y += TITLE_SIZE;
        let title = fit_text(title, TITLE_SIZE, right - left);
        shapes.push(text(left, y, &title, TITLE_SIZE, Anchor::Start));
        y += GAP;
    }
    if figure.runs.len() > 1 {
        let named = |&(run, _): &(usize, &String)| !figure.family || is_named(run, figure.runs.len());
        let entries = figure.runs.iter().enumerate().filter(named);
        let entries = entries.map(|(run, name)| (run_stroke(coding, run), name.as_str()));
        y = legend(shapes, &entries.collect::<Vec<_>>(), left, right, y);
    }
    for (k, (panel, axis)) in figure.panels.iter().zip(&axes).enumerate() {
        let names = panel.names();
        if names.len() > 1 {
            let entries = names.iter().enumerate().map(|(variable, name)| (curve_stroke(coding, variable, 0), *name));
            y = legend(shapes, &entries.collect::<Vec<_>>(), left, right, y);
        }
        let frame = Frame { left, right, top: y + 2.0, bottom: y + 2.0 + height };
        draw_axes(shapes, frame, &time, axis, k + 1 == figure.panels.len());
        draw_value_label(shapes, frame, &names, axis);
        draw_curves(shapes, frame, &time, axis, panel, coding);
        y = frame.bottom + 2.0 * GAP;
    }
    if let Some(axis) = (!figure.panels.is_empty()).then_some(&time) {
        y += TICK + 1.5 * TEXT_SIZE;
        let label = format!("time [{}]", axis.scale.unit);
        shapes.push(text((left + right) / 2.0, y, &label, TEXT_SIZE, Anchor::Middle));
    }
    drawing.height = (y + 2.0 * GAP).ceil();
    drawing
}

/// True for the members of a family that the legend names: the first, the last, and some at equal distances.
fn is_named(run: usize, runs: usize) -> bool {
    let entry = |k: usize| k * (runs - 1) / (FAMILY_NAMES - 1);
    runs <= FAMILY_NAMES || (0..FAMILY_NAMES).any(|k| entry(k) == run)
}

fn coding(figure: &Figure) -> Coding {
    if figure.family {
        return Coding::Family(figure.runs.len());
    }
    let single = figure.panels.iter().all(|panel| panel.names().len() <= 1);
    if single && figure.runs.len() > 1 { Coding::ByRun } else { Coding::ByVariable }
}

/// Smallest and largest finite number; 0 and 0 if there is none.
fn range<'a>(numbers: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    let finite = numbers.filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
    if low > high { (0.0, 0.0) } else { (low, high) }
}

fn time_axis(figure: &Figure) -> Axis {
    let (low, high) = range(figure.panels.iter().flat_map(|p| &p.curves).flat_map(|c| c.times.iter()));
    Axis::new(low, high, 0.0, "s", 10)
}

fn value_axis(panel: &Panel, height: f64) -> Axis {
    let (low, high) = range(panel.curves.iter().flat_map(|curve| &curve.values));
    // Truth values need no ticks in between.
    let intervals = if panel.unit == "0/1" { 2 } else { ((height / 22.0) as usize).clamp(3, 8) };
    Axis::new(low, high, 0.05, &panel.unit, intervals)
}

fn text(x: f64, y: f64, text: &str, size: f64, anchor: Anchor) -> Shape {
    Shape::Text { at: (x, y), text: text.to_string(), size, anchor, upward: false, colour: TEXT }
}

/// Draws entries from left to right in as many lines as needed; returns the y below them.
fn legend(shapes: &mut Vec<Shape>, entries: &[(crate::drawing::Stroke, &str)], left: f64, right: f64, top: f64) -> f64 {
    let (mut x, mut y) = (left, top + LINE);
    for (stroke, name) in entries {
        let name = fit_text(name, TEXT_SIZE, right - left - SAMPLE - GAP);
        let width = SAMPLE + GAP + text_width(&name, TEXT_SIZE);
        if x > left && x + width > right {
            (x, y) = (left, y + LINE);
        }
        let middle = y - 0.35 * TEXT_SIZE;
        shapes.push(Shape::Lines { pieces: vec![vec![(x, middle), (x + SAMPLE, middle)]], stroke: stroke.clone() });
        shapes.push(text(x + SAMPLE + GAP, y, &name, TEXT_SIZE, Anchor::Start));
        x += width + 3.0 * GAP;
    }
    y + GAP
}

fn draw_axes(shapes: &mut Vec<Shape>, frame: Frame, time: &Axis, axis: &Axis, lowest: bool) {
    let Frame { left, right, top, bottom } = frame;
    let (mut grid, mut lines, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    for (value, label) in time.ticks.values.iter().zip(&time.ticks.labels) {
        let x = time.place_scaled(*value, left, right);
        grid.push(vec![(x, top), (x, bottom)]);
        lines.push(vec![(x, bottom), (x, bottom + TICK)]);
        if lowest {
            labels.push(text(x, bottom + TICK + TEXT_SIZE, label, TEXT_SIZE, Anchor::Middle));
        }
    }
    for (value, label) in axis.ticks.values.iter().zip(&axis.ticks.labels) {
        let y = axis.place_scaled(*value, bottom, top);
        grid.push(vec![(left, y), (right, y)]);
        lines.push(vec![(left - TICK, y), (left, y)]);
        labels.push(text(left - TICK - 3.0, y + 0.35 * TEXT_SIZE, label, TEXT_SIZE, Anchor::End));
    }
    lines.push(vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]);
    shapes.push(Shape::Lines { pieces: grid, stroke: GRID });
    shapes.push(Shape::Lines { pieces: lines, stroke: FRAME });
    shapes.extend(labels);
}

/// `p_R [MPa]` for one variable; the unit alone where a legend names several.
fn draw_value_label(shapes: &mut Vec<Shape>, frame: Frame, names: &[&str], axis: &Axis) {
    let unit = if axis.scale.unit.is_empty() { String::new() } else { format!("[{}]", axis.scale.unit) };
    let label = match names {
        [name] => {
            let rest = frame.bottom - frame.top - text_width(&unit, TEXT_SIZE) - GAP;
            format!("{} {unit}", fit_text(name, TEXT_SIZE, rest))
        }
        _ => unit,
    };
    shapes.push(Shape::Text {
        at: (TEXT_SIZE + GAP, (frame.top + frame.bottom) / 2.0),
        text: label.trim().to_string(),
        size: TEXT_SIZE,
        anchor: Anchor::Middle,
        upward: true,
        colour: TEXT,
    });
}

fn draw_curves(shapes: &mut Vec<Shape>, frame: Frame, time: &Axis, axis: &Axis, panel: &Panel, coding: Coding) {
    let names = panel.names();
    for curve in &panel.curves {
        let variable = names.iter().position(|name| *name == curve.name).unwrap_or(0);
        let place = |(t, value): (&f64, &f64)| {
            (time.place(*t, frame.left, frame.right), axis.place(*value, frame.bottom, frame.top))
        };
        let points: Vec<(f64, f64)> = curve.times.iter().zip(&curve.values).map(place).collect();
        let columns = (frame.right - frame.left).ceil() as usize;
        let pieces = simplify(&points, frame.left, frame.right, columns.clamp(1, 500));
        shapes.push(Shape::Lines { pieces, stroke: curve_stroke(coding, variable, curve.run) });
    }
}
