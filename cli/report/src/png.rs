//! A drawing as a PNG image, by the rasteriser of the crate `tiny-skia`.
//!
//! Letters are filled outlines of the built-in font, so the image looks the same on every machine.

use std::fmt;

use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, StrokeDash, Transform};
use ttf_parser::OutlineBuilder;

use crate::drawing::{Anchor, Colour, Drawing, Shape, Stroke};
use crate::font::{advance, face, glyph, text_width};

/// Why there is no image.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum PngError {
    /// The image would be empty or larger than the rasteriser can hold.
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The image could not be encoded.
    Encoding(String),
}

impl fmt::Display for PngError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PngError::Size { width, height } => {
                write!(f, "an image of {width} by {height} pixels cannot be made")
            }
            PngError::Encoding(text) => write!(f, "the image cannot be encoded: {text}"),
        }
    }
}

impl std::error::Error for PngError {}

impl Drawing {
    /// The drawing as the bytes of a PNG file with `scale` image pixels per pixel of the drawing (2: 192 dpi).
    pub fn png(&self, scale: f64) -> Result<Vec<u8>, PngError> {
        let (width, height) = ((self.width * scale).round() as u32, (self.height * scale).round() as u32);
        let mut image = Pixmap::new(width, height).ok_or(PngError::Size { width, height })?;
        image.fill(tiny_skia::Color::WHITE);
        let to_image = Transform::from_scale(scale as f32, scale as f32);
        for shape in &self.shapes {
            match shape {
                Shape::Lines { pieces, stroke } => draw_lines(&mut image, pieces, stroke, to_image),
                Shape::Text { at, text, size, anchor, upward, colour } => {
                    let shift = match anchor {
                        Anchor::Start => 0.0,
                        Anchor::Middle => -0.5,
                        Anchor::End => -1.0,
                    } * text_width(text, *size);
                    let turned = if *upward { Transform::from_rotate(-90.0) } else { Transform::identity() };
                    let place = turned.post_translate(at.0 as f32, at.1 as f32).post_concat(to_image);
                    if let Some(outline) = outline(text, *size, shift) {
                        image.fill_path(&outline, &paint(*colour), FillRule::Winding, place, None);
                    }
                }
            }
        }
        image.encode_png().map_err(|error| PngError::Encoding(error.to_string()))
    }
}

fn paint(colour: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(colour[0], colour[1], colour[2], 255);
    paint
}

fn draw_lines(image: &mut Pixmap, pieces: &[Vec<(f64, f64)>], stroke: &Stroke, to_image: Transform) {
    let mut builder = PathBuilder::new();
    for piece in pieces {
        for (k, &(x, y)) in piece.iter().enumerate() {
            let (x, y) = (x as f32, y as f32);
            if k == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
        }
        if let [(x, y)] = piece[..] {
            // A dot: the rasteriser drops lines without length.
            builder.line_to(x as f32 + 0.01, y as f32);
        }
    }
    let Some(path) = builder.finish() else { return };
    let dash = stroke.dash.iter().map(|&length| length as f32).collect::<Vec<f32>>();
    let line = tiny_skia::Stroke {
        width: stroke.width as f32,
        line_cap: if dash.is_empty() { LineCap::Round } else { LineCap::Butt },
        line_join: LineJoin::Round,
        dash: if dash.is_empty() { None } else { StrokeDash::new(dash, 0.0) },
        ..Default::default()
    };
    image.stroke_path(&path, &paint(stroke.colour), &line, to_image, None);
}

/// The outline of a text whose base line begins at (`shift`, 0).
fn outline(text: &str, size: f64, shift: f64) -> Option<Path> {
    let scale = size / f64::from(face().units_per_em());
    let mut pen = Pen { builder: PathBuilder::new(), x: shift, scale };
    for letter in text.chars() {
        let glyph = glyph(letter);
        face().outline_glyph(glyph, &mut pen);
        pen.x += advance(glyph) * scale;
    }
    pen.builder.finish()
}

/// Takes outlines in units of the font (y up) and draws them in pixels (y down).
struct Pen {
    builder: PathBuilder,
    x: f64,
    scale: f64,
}

impl Pen {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        ((self.x + f64::from(x) * self.scale) as f32, (-f64::from(y) * self.scale) as f32)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.builder.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.builder.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.place(x1, y1), self.place(x, y));
        self.builder.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.builder.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn pixels(shapes: Vec<Shape>) -> Pixmap {
        let bytes = Drawing { width: 40.0, height: 20.0, shapes }.png(2.0).unwrap();
        Pixmap::decode_png(&bytes).unwrap()
    }

    #[test]
    fn lines_and_letters_leave_ink_where_they_stand() {
        let stroke = Stroke { colour: [0, 0, 255], width: 2.0, dash: &[] };
        let image = pixels(vec![Shape::Lines { pieces: vec![vec![(0.0, 10.0), (40.0, 10.0)]], stroke }]);
        assert_eq!((image.width(), image.height()), (80, 40));
        let colour = |x, y| image.pixel(x, y).map(|p| (p.red(), p.green(), p.blue())).unwrap();
        assert_eq!(colour(40, 20), (0, 0, 255));
        assert_eq!(colour(40, 5), (255, 255, 255));

        // A letter `l` is a vertical bar above its base line.
        let text = |upward| Shape::Text {
            at: (20.0, 15.0),
            text: "l".into(),
            size: 12.0,
            anchor: Anchor::Start,
            upward,
            colour: [0, 0, 0],
        };
        let dark = |image: &Pixmap| {
            let places = (0..40u32).flat_map(|y| (0..80u32).map(move |x| (x, y)));
            let inked: Vec<(u32, u32)> =
                places.filter(|&(x, y)| image.pixel(x, y).is_some_and(|p| p.red() < 128)).collect();
            let range = |v: Vec<u32>| v.iter().max().unwrap() - v.iter().min().unwrap();
            (range(inked.iter().map(|p| p.0).collect()), range(inked.iter().map(|p| p.1).collect()))
        };
        let (wide, high) = dark(&pixels(vec![text(false)]));
        assert!(high > 12 && wide < 5, "{wide} {high}");
        let (wide, high) = dark(&pixels(vec![text(true)]));
        assert!(wide > 12 && high < 5, "{wide} {high}");
    }

    #[test]
    fn impossible_sizes_are_refused() {
        let drawing = Drawing { width: 0.0, height: 20.0, shapes: Vec::new() };
        assert_eq!(drawing.png(1.0), Err(PngError::Size { width: 0, height: 20 }));
    }
}
