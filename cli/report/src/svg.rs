//! A drawing as SVG 1.1 text.
//!
//! Texts stay texts (searchable, editable); coordinates have two decimals.  The same drawing gives the same bytes.

use std::fmt::Write as _;

use crate::drawing::{Anchor, Colour, Drawing, Shape, Stroke};

impl Drawing {
    /// The drawing as the text of an SVG file.
    pub fn svg(&self) -> String {
        let (width, height) = (self.width, self.height);
        let mut svg = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" \
             font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>"
        );
        for shape in &self.shapes {
            match shape {
                Shape::Lines { pieces, stroke } => lines(&mut svg, pieces, stroke),
                Shape::Text { at, text, size, anchor, upward, colour } => {
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let turn = if *upward { " rotate(-90)" } else { "" };
                    let _ = writeln!(
                        svg,
                        "<text transform=\"translate({:.2} {:.2}){turn}\" font-size=\"{size}\" \
                         text-anchor=\"{anchor}\" fill=\"{}\">{}</text>",
                        at.0,
                        at.1,
                        hex(*colour),
                        escape(text)
                    );
                }
            }
        }
        svg.push_str("</svg>\n");
        svg
    }
}

fn lines(svg: &mut String, pieces: &[Vec<(f64, f64)>], stroke: &Stroke) {
    if pieces.iter().all(Vec::is_empty) {
        return;
    }
    svg.push_str("<path d=\"");
    for piece in pieces {
        for (k, (x, y)) in piece.iter().enumerate() {
            let command = if k == 0 { 'M' } else { 'L' };
            let _ = write!(svg, "{command}{} {}", short(*x), short(*y));
        }
        if piece.len() == 1 {
            svg.push_str("h0");
        }
    }
    let _ = write!(
        svg,
        "\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"",
        hex(stroke.colour),
        stroke.width
    );
    if stroke.dash.is_empty() {
        svg.push_str(" stroke-linecap=\"round\"");
    } else {
        let dash: Vec<String> = stroke.dash.iter().map(f64::to_string).collect();
        let _ = write!(svg, " stroke-dasharray=\"{}\"", dash.join(" "));
    }
    svg.push_str("/>\n");
}

fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

fn hex(colour: Colour) -> String {
    format!("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2])
}

/// Text for XML; characters that XML forbids become the replacement character.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\u{FFFE}' | '\u{FFFF}' => escaped.push('\u{FFFD}'),
            c if c < ' ' => escaped.push('\u{FFFD}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_text_of_a_small_drawing() {
        let stroke = Stroke { colour: [0, 0x72, 0xB2], width: 1.5, dash: &[6.0, 3.0] };
        let drawing = Drawing {
            width: 100.0,
            height: 50.0,
            shapes: vec![
                Shape::Lines { pieces: vec![vec![(1.0, 2.0), (3.456, 4.5)], vec![(9.0, 9.0)]], stroke: stroke.clone() },
                Shape::Lines { pieces: vec![Vec::new()], stroke },
                Shape::Text {
                    at: (5.0, 6.0),
                    text: "a<b & \u{1}".into(),
                    size: 12.0,
                    anchor: Anchor::Middle,
                    upward: true,
                    colour: [0, 0, 0],
                },
            ],
        };
        let expected = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
            <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"50\" viewBox=\"0 0 100 50\" font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n\
            <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
            <path d=\"M1 2L3.46 4.5M9 9h0\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"1.5\" stroke-linejoin=\"round\" stroke-dasharray=\"6 3\"/>\n\
            <text transform=\"translate(5.00 6.00) rotate(-90)\" font-size=\"12\" text-anchor=\"middle\" fill=\"#000000\">a&lt;b &amp; \u{FFFD}</text>\n\
            </svg>\n";
        assert_eq!(drawing.svg(), expected);
    }
}
