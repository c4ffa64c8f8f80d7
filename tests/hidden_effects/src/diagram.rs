//! The reliability diagram: what share of effects is seen, over the drop of the cost that the generator expects, beside
//! what that drop foretells.  Points are groups of equally many trials with exact 95 % intervals; written as SVG.

use crate::rows::{End, Row};
use crate::statistics::{Share, quantile};
use crate::summary::foretold;
use std::fmt::Write;

/// Size of the picture, and of the margins to the left and below.
const SIZE: (f64, f64) = (640.0, 360.0);
const MARGIN: (f64, f64) = (60.0, 48.0);
/// Powers of ten of the expected drop from which to which the axis goes.
const DECADES: (f64, f64) = (-1.0, 8.0);
/// Most groups, and fewest trials of one.
const GROUPS: usize = 10;
const FEWEST: usize = 5;

/// The picture.
pub fn reliability(rows: &[Row]) -> String {
    let mut trials: Vec<(f64, &Row)> = rows
        .iter()
        .filter(|row| row.kind() == "effect")
        .filter_map(|row| Some((row.number("power")?.max(1e-3), row)))
        .collect();
    trials.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut text = frame();
    let curve: Vec<String> = (0..=180)
        .map(|k| DECADES.0 + (DECADES.1 - DECADES.0) * f64::from(k) / 180.0)
        .map(|decade| format!("{:.1},{:.1}", across(decade), up(foretold(10f64.powf(decade)))))
        .collect();
    let _ = writeln!(
        text,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#888\" stroke-width=\"1.5\" stroke-dasharray=\"5 3\"/>",
        curve.join(" ")
    );
    let group = trials.len().div_ceil(GROUPS).max(FEWEST);
    for own in trials.chunks(group) {
        let powers: Vec<f64> = own.iter().map(|(power, _)| power.log10()).collect();
        let x = across(quantile(&powers, 0.5).unwrap_or(0.0));
        let seen = Share::of(own, |(_, row)| !matches!(row.end(), End::Adequate | End::None));
        let right = Share::of(own, |(_, row)| matches!(row.end(), End::Right | End::Among));
        let (low, high) = seen.interval();
        let _ = writeln!(
            text,
            "<path d=\"M{x:.1} {:.1}V{:.1}\" stroke=\"#1f4e79\"/><circle cx=\"{x:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"#1f4e79\"/>\
             <circle cx=\"{x:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"none\" stroke=\"#b5532a\" stroke-width=\"1.5\"/>",
            up(low),
            up(high),
            up(seen.value()),
            up(right.value())
        );
    }
    text + "</svg>\n"
}

fn across(decade: f64) -> f64 {
    let share = ((decade - DECADES.0) / (DECADES.1 - DECADES.0)).clamp(0.0, 1.0);
    MARGIN.0 + share * (SIZE.0 - MARGIN.0 - 16.0)
}

fn up(share: f64) -> f64 {
    SIZE.1 - MARGIN.1 - share * (SIZE.1 - MARGIN.1 - 34.0)
}

/// Axes, grid, words.
fn frame() -> String {
    let (width, height) = SIZE;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n\
         <text x=\"{}\" y=\"18\">dots: seen (95 % interval); rings: right or in a choice; dashed: foretold</text>\n",
        MARGIN.0
    );
    for decade in 0..=DECADES.1 as i32 {
        let x = across(f64::from(decade));
        let _ = writeln!(
            text,
            "<path d=\"M{x:.1} {:.1}V{:.1}\" stroke=\"#e4e4e4\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">1e{decade}</text>",
            up(0.0),
            up(1.0),
            up(0.0) + 16.0
        );
    }
    for part in 0..=5 {
        let share = f64::from(part) / 5.0;
        let _ = writeln!(
            text,
            "<path d=\"M{:.1} {:.1}H{:.1}\" stroke=\"#e4e4e4\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{:.0} %</text>",
            MARGIN.0,
            up(share),
            width - 16.0,
            MARGIN.0 - 6.0,
            up(share) + 4.0,
            100.0 * share
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">expected drop of the cost</text>",
        0.5 * (MARGIN.0 + width),
        height - 10.0
    );
    text
}
